/*
 * surfelshop.h: the plugin boundary of Surfelshop for C and C++.
 *
 * A plugin is a shared library, or a WebAssembly module, that exports two objects: SURFELSHOP_MANIFEST, bytes that say what
 * the library is, which the host reads before it loads any code, and SURFELSHOP_PLUGIN, a table of
 * functions; one that reads or writes files exports SURFELSHOP_FORMATS, too. rim.c beside this file is
 * a whole renderer, gaussians.c one that reads columns and draws splats, and xyzb.c a whole file format.
 * They are built with
 *
 *     cc -shared -fPIC -O2 -o librim_c.so rim.c
 *     cc -shared -fPIC -O2 -o libgaussians_c.so gaussians.c -lm
 *     cc -shared -fPIC -O2 -o libxyzb_c.so xyzb.c -lm
 *
 * and used like any other plugin. A module that runs in a sandbox, so that nobody has to trust it, is
 * built from the same file with Debian's packages clang, lld, wasi-libc and libclang-rt-14-dev-wasm32:
 *
 *     clang --target=wasm32-wasi -O2 -nostartfiles -Wl,--no-entry -Wl,--export-table \
 *         -Wl,--growable-table -Wl,--export=SURFELSHOP_PLUGIN \
 *         -Wl,--export-if-defined=SURFELSHOP_FORMATS -Wl,--strip-all -o rim.wasm rim.c
 *
 * This header is plain C99 and compiles as C++, too; it
 * needs nothing but the C library.
 *
 * What crosses the boundary is either a structure declared here or a message in MessagePack, which
 * surfelshop_msgpack.h beside this file builds and reads. Messages are what Rust's serde makes of
 * the types in host/sdk/api/src, with the names of the fields:
 *
 *     structure                   map from the names of its fields, as strings, to their values
 *     variant without contents    string: "Frame"
 *     variant of one value        map of one entry: {"Float": 3.0}
 *     variant with fields         map of one entry: {"View": {"divisor": 1}}
 *     TextureId and the like      whole number, the position in its list
 *     list, tuple, vector         array;  a rotation (quaternion) is an array x, y, z, w
 *     BTreeMap                    map;    Option: nil or the value
 *
 * Readers ignore fields they do not know, and so must plugins: newer hosts send more. Some enums
 * rename their variants, which the Rust type shows as `#[serde(rename_all = ...)]`.
 *
 * Licence: MIT OR Apache-2.0.
 */
#ifndef SURFELSHOP_H
#define SURFELSHOP_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
#define SURFELSHOP_C_NAME extern "C"
#else
#define SURFELSHOP_C_NAME
#endif

/** Goes before the definition of an object that the library exports. */
#if defined(_WIN32)
#define SURFELSHOP_EXPORT SURFELSHOP_C_NAME __declspec(dllexport)
#else
#define SURFELSHOP_EXPORT SURFELSHOP_C_NAME __attribute__((visibility("default")))
#endif

/* An array of negative length stops the compiler; C99 has no other static assertion. */
#define SURFELSHOP_ASSERT(name, condition) \
    typedef char surfelshop_assert_##name[(condition) ? 1 : -1]

/**
 * The boundary this header describes. Hosts refuse plugins of another major version and those of a
 * larger minor version than their own.
 */
#define SURFELSHOP_ABI_MAJOR 3
#define SURFELSHOP_ABI_MINOR 11

#ifdef __cplusplus
extern "C" {
#endif

/** How a call ended. */
enum {
    /** As asked. */
    SURFELSHOP_OK = 0,
    /** Not as asked; the error channel says why. */
    SURFELSHOP_ERROR = 1,
    /** The plugin's code went wrong in a way it did not foresee (in Rust: panicked). */
    SURFELSHOP_PANIC = 2,
    /**
     * Of the host's functions for clouds of files: there is no more, or no more is wanted. Nothing
     * failed. The exported functions do not return it. ABI 3.8.
     */
    SURFELSHOP_END = 3
};

/** What bytes written to a sink are. */
enum {
    /** One line of UTF-8 that says what was expected and what was found. */
    SURFELSHOP_CHANNEL_ERROR = 1,
    /** A unit's description of itself: Description, see `describe`. */
    SURFELSHOP_CHANNEL_DESCRIPTION = 2,
    /** The structure of a graph: Structure of host/sdk/api/src/graph/structure.rs. */
    SURFELSHOP_CHANNEL_STRUCTURE = 3,
    /**
     * The bytes of a graph's uniforms and uploads, which the structure names by offset and length.
     * Uniforms start at multiples of 256 bytes, uploads at multiples of 4. They are laid out as the
     * WGSL structure is, little-endian. Bytes of a buffer with a key `resident` are left out, and its
     * `upload` is nil, where the request lists that key with their number; since ABI 3.10.
     */
    SURFELSHOP_CHANNEL_DATA = 4,
    /** The header of a cloud that is written, from the host, see `next_cloud`. ABI 3.8. */
    SURFELSHOP_CHANNEL_HEADER = 5,
    /** What a file that was written cannot hold: an array of lines for people. ABI 3.8. */
    SURFELSHOP_CHANNEL_LINES = 6,
    /** The first buffer of a computation, see `compute`; those of the others follow. */
    SURFELSHOP_CHANNEL_BUFFERS = 16
};

/** Types of a column's elements. Skip columns of other codes: they are of newer hosts. */
enum {
    SURFELSHOP_I8 = 0,
    SURFELSHOP_U8 = 1,
    SURFELSHOP_I16 = 2,
    SURFELSHOP_U16 = 3,
    SURFELSHOP_I32 = 4,
    SURFELSHOP_U32 = 5,
    SURFELSHOP_F32 = 6,
    SURFELSHOP_F64 = 7
};

/**
 * Borrowed bytes: they belong to who passes them, and are valid until the call returns. `ptr` may
 * be NULL or lead nowhere where `len` is 0. Text is UTF-8 and has no terminating zero.
 */
typedef struct surfelshop_bytes {
    const uint8_t *ptr;
    size_t len;
} surfelshop_bytes;

/**
 * Where one side writes what it makes, during the call it was passed to and on that call's thread
 * only. `write` copies the bytes, so the caller keeps them, and replaces what the channel held. A
 * host takes at most 2^30 bytes in one call, replaced ones included; of these at most 16 MiB of a
 * graph's structure and 1 MiB of a description, and of an error line the first 4 KiB.
 */
typedef struct surfelshop_sink {
    void *context;
    void (*write)(void *context, uint32_t channel, surfelshop_bytes bytes);
} surfelshop_sink;

/**
 * One column of a cloud. Everything stays the host's and is valid until the call returns.
 *
 * Usual columns: "position" (3 F32, offsets from the cloud's origin, scene units), "normal" (3 F32,
 * unit length, outwards), "radius" (1 F32, scene units), "color" (3 or 4 U8 or U16, sRGB, or F32,
 * linear Rec. 709), "tangent_u" and "tangent_v" (3 F32, half axes of an ellipse), "ao" (1 F32,
 * accessibility from 0 to 1), "material" (1 U32). Any of them may be missing.
 */
typedef struct surfelshop_column {
    surfelshop_bytes name;
    /** SURFELSHOP_I8 to SURFELSHOP_F64. */
    uint32_t element;
    /** Elements per surfel, at least 1; those of a surfel lie together. */
    uint32_t components;
    /** Equal generations mean equal values. */
    uint64_t generation;
    /** The first element, aligned for its type; not to be read where `len` is 0. */
    const void *values;
    /** Number of elements: surfels times components. */
    size_t len;
} surfelshop_column;

/** A cloud. Everything stays the host's and is valid until the call returns. */
typedef struct surfelshop_cloud {
    /** World position that positions are relative to, scene units. */
    double origin[3];
    /** Number of surfels. */
    size_t len;
    const surfelshop_column *columns;
    size_t n_columns;
    /**
     * Triangles: positions of three surfels each, below `len`, counterclockwise from outside; not
     * to be read where `n_faces` is 0.
     */
    const uint32_t (*faces)[3];
    size_t n_faces;
    /**
     * The cloud's own box: its middle (world space), its largest extent (scene units, above 0), and
     * its rotation as a quaternion x, y, z, w.
     */
    double object[8];
} surfelshop_cloud;

/** A rectangle of the picture, in pixels from its upper left corner. */
typedef struct surfelshop_tile {
    uint32_t x;
    uint32_t y;
    uint32_t width;
    uint32_t height;
    /** Which sample of each pixel this call computes, from 0. */
    uint32_t sample;
} surfelshop_tile;

/**
 * A running call's line to the host. The functions take `context`, are never NULL, and are called
 * until that call returns, on its thread only: not from inside the `work` of `parallel`.
 */
typedef struct surfelshop_job {
    void *context;
    /** Progress from 0 to 1, and what is being done; an empty message keeps the last. */
    void (*progress)(void *context, double fraction, surfelshop_bytes message);
    /** 1 where the user asked to stop, and the call should return an error soon; else 0. */
    uint32_t (*cancelled)(void *context);
    /**
     * Stages an edit, for tools. `header` is EditHeader of host/sdk/api/src/tool.rs, one of
     *
     *     {"Columns": [{"name": "ao", "components": 1, "element": "f32"}, ...]}
     *     "Keep"
     *     {"Values": [...]}   since ABI 3.11: the first element of `values` is places of surfels, uint32_t
     *                         each, and the columns have the values of these alone
     *     {"Add": [...]}      since ABI 3.11: new surfels; the first element of `values` is for each a surfel
     *                         whose values it has in columns that are not told, uint32_t each
     *     {"NewCloud": {"origin": [x, y, z], "columns": [...]}}
     *
     * and `values` has the little-endian elements of each of these columns, or for "Keep" one byte
     * per surfel, 1 where it stays and else 0. The host copies them. A run stages columns as often
     * and "Values" as it likes and then at most one "Keep" or "Add", or one new cloud and nothing else. Where it returns
     * anything but SURFELSHOP_OK, the reason is on the error channel of `sink`, which is the
     * plugin's own.
     */
    int32_t (*stage)(void *context, surfelshop_bytes header, const surfelshop_bytes *values,
                     size_t n_values, surfelshop_sink sink);
    /**
     * Calls `work` with ranges, first and behind the last, that cover 0 to `count` without overlap,
     * on several threads at once and in any order; returns when all have ended. Progress goes from
     * `from` to `to`. Returns 1 where ranges were left out since the user asked to stop, else 0.
     * `work` calls nothing of the job, and like the exported functions it must not unwind.
     */
    uint32_t (*parallel)(void *context, size_t count, double from, double to,
                         void (*work)(const void *work_context, size_t start, size_t end),
                         const void *work_context);
    /**
     * Runs compute passes on the graphics device, for tools: `structure` and `data` are what a
     * renderer writes, but without outputs and with nothing of a view. The bytes of the buffers,
     * named by their positions in the structure, go to SURFELSHOP_CHANNEL_BUFFERS and the channels
     * behind it of `sink`, which is the plugin's own. Where it returns anything but SURFELSHOP_OK
     * (there may be no device), the reason is on the error channel.
     */
    int32_t (*compute)(void *context, surfelshop_bytes structure, surfelshop_bytes data,
                       const uint32_t *buffers, size_t n_buffers, surfelshop_sink sink);
} surfelshop_job;

/**
 * The exported functions. None may be NULL. Each returns SURFELSHOP_OK, or SURFELSHOP_ERROR after
 * it wrote a line to the error channel. None may be left by a C++ exception or by longjmp: the host
 * is written in Rust, and its frames must not be unwound by others. In C++, catch everything, write
 * the line and return SURFELSHOP_PANIC.
 *
 * What is passed in stays the host's and is valid until the call returns; copy what is kept. What
 * the plugin allocates it frees itself. Units are numbered from 0 as the manifest lists them.
 *
 * All units need the first three functions, renderers `frame`, tracers `tile`, and tools `run`; the
 * others are surfelshop_no_frame, surfelshop_no_tile and surfelshop_no_run. Formats need a table of
 * their own besides, surfelshop_format_table.
 *
 * Calls come from any thread. Those on one instance come one after the other, but for `tile`, which
 * runs on several threads at once; different instances work at the same time. The host waits some
 * seconds for an instance or a frame, and asks no more where none came. It never unloads a library.
 */
typedef struct surfelshop_plugin_table {
    /** Head of the table: SURFELSHOP_TABLE_HEAD fills these four. */
    uint8_t magic[8];
    uint32_t size;
    uint16_t abi_major;
    uint16_t abi_minor;
    /**
     * Writes the description of a unit, {"params": [...], "limits": [...]}: ParamDecl of
     * host/sdk/api/src/params.rs and Limit of host/sdk/api/src/unit.rs. Tools may add a "scope", one of
     * "cloud", "surfel", "neighbours" and "scene", by which they run over clouds larger than memory: Scope
     * of the latter file. Since ABI 3.11 they may add a "handling", such as
     *
     *     {"stroke": {"spacing": 0.25, "falloff": "smooth", "reach": "facing"}}
     *
     * or the same with "click": Handling of host/sdk/api/src/stroke.rs. The manifest then has a line
     * "handling\tstroke\n" behind the tool's, and `run` gets {"values": {...}, "stroke": {...}}, StrokeCall of
     * that file, in the place of the values alone, with a cloud of the surfels that are concerned; its column
     * "stroke_weight" says how much. The description is the same at every call.
     */
    int32_t (*describe)(uint32_t unit, surfelshop_sink sink);
    /**
     * Makes an instance of a unit, one for each view, run or file: reads HostInfo of
     * host/sdk/api/src/frame.rs (`features` and, since ABI 3.10, `limits` say what the device has and
     * takes; passes name the features that they need in `needs`) and puts a pointer that is not NULL into `out`. The host does nothing
     * with the pointer but to pass it back.
     */
    int32_t (*create)(uint32_t unit, surfelshop_bytes host, void **out, surfelshop_sink sink);
    /** Ends an instance and frees what it holds; comes once for each. */
    int32_t (*destroy)(void *instance, surfelshop_sink sink);
    /**
     * Renderers: reads FrameRequest of host/sdk/api/src/frame.rs and writes the structure and the data
     * of its graph. Parameters are in the map `values` by their ids, such as {"Float": 3.0}. Where
     * one is missing, of another kind or no number, the plugin takes the default, and where it is
     * out of range, the nearer end. The host compiles nothing where a structure has the same bytes
     * as the one before, so what changes from frame to frame belongs into the data. Since ABI 3.10 a
     * request may have `resident`, an array of {"key": "brdf", "len": 4000}: bytes of this unit that
     * are on the device.
     */
    int32_t (*frame)(void *instance, surfelshop_bytes request, surfelshop_sink sink);
    /**
     * Tracers: computes one sample of each pixel of a tile into `pixels`, row by row, four floats
     * each: linear Rec. 709 radiance weighted by coverage, and coverage. `n_floats` is 4 * width *
     * height; the host lends these floats to this call alone. `request` is as of `frame`, `clouds`
     * are in the order of its `cloud.objects`, and `texels` are the octahedral map of its
     * `environment`, three floats each, none where it has none. Neither is to be read where its
     * number is 0. A sample depends on the frame, the pixel and its own number alone. The instance
     * is shared with calls on other threads.
     */
    int32_t (*tile)(const void *instance, surfelshop_bytes request, const surfelshop_cloud *clouds,
                    size_t n_clouds, const float (*texels)[3], size_t n_texels,
                    const surfelshop_tile *tile, float *pixels, size_t n_floats,
                    const surfelshop_job *job, surfelshop_sink sink);
    /**
     * Tools: reads a cloud and stages edits. `values` are the parameters, a map as in a frame's
     * request. What was staged is committed where this returns SURFELSHOP_OK, and else dropped.
     */
    int32_t (*run)(void *instance, surfelshop_bytes values, const surfelshop_cloud *cloud,
                   const surfelshop_job *job, surfelshop_sink sink);
} surfelshop_plugin_table;

/**
 * A file that the host lends to a format. The functions take `context` and are never NULL. Until the
 * call returns that the file was lent to they may be called from any thread, from several at once.
 *
 * `sink` may be the plugin's own, or that of the call which the file was lent to, on whose thread
 * alone it may be used: then what went wrong is the host's own line, and returning the status hands
 * it on. ABI 3.8.
 */
typedef struct surfelshop_file {
    void *context;
    /** The file's name without its folder. */
    surfelshop_bytes name;
    /** Length in bytes; of a file that is written, as far as it was. */
    uint64_t (*length)(void *context);
    /**
     * Reads up to `len` bytes from an offset into `buffer` and stores how many there were in
     * `n_read`: fewer only at the file's end. Returns a status.
     */
    int32_t (*read_at)(void *context, uint64_t offset, uint8_t *buffer, size_t len, size_t *n_read,
                       surfelshop_sink sink);
    /**
     * Writes bytes at an offset; the file grows where it ends before, and what is in between is 0.
     * Returns a status; fails for a file that is read.
     */
    int32_t (*write_at)(void *context, uint64_t offset, surfelshop_bytes bytes,
                        surfelshop_sink sink);
} surfelshop_file;

/**
 * Where a format puts the clouds that it reads, one after the other: for each the header, then its
 * points in batches. The functions take `context`, are never NULL, and are called by one thread at a
 * time. `sink` is as of a file. ABI 3.8.
 */
typedef struct surfelshop_cloud_sink {
    void *context;
    /**
     * Takes the header of the next cloud: CloudHeader of host/sdk/api/src/format/header.rs. All but
     * `columns` may be left out:
     *
     *     {"format": "XYZB", "rows": 2, "columns": [
     *         {"name": "position", "components": 3, "element": "f64"}, ...]}
     *
     * Returns SURFELSHOP_OK where the points are wanted, SURFELSHOP_END where the header was all
     * that is wanted, and else an error.
     */
    int32_t (*begin)(void *context, surfelshop_bytes header, surfelshop_sink sink);
    /**
     * Takes the next points: for each column of the header its values as they lie in memory, all
     * components of a point together. The host copies them; 65536 points are a good number.
     * Returns a status.
     */
    int32_t (*batch)(void *context, const surfelshop_bytes *values, size_t n_values,
                     surfelshop_sink sink);
    /**
     * Takes triangles: positions of three points each, counted from the cloud's first. Returns a
     * status.
     */
    int32_t (*faces)(void *context, const uint32_t (*triangles)[3], size_t n_triangles,
                     surfelshop_sink sink);
    /** Takes a line for people, of what is doubtful in the file. */
    void (*warn)(void *context, surfelshop_bytes line);
} surfelshop_cloud_sink;

/**
 * Where a format takes the clouds that it writes, one after the other. The functions take `context`,
 * are never NULL, and are called by one thread at a time. ABI 3.8.
 */
typedef struct surfelshop_cloud_source {
    void *context;
    /**
     * Writes the header of the next cloud to SURFELSHOP_CHANNEL_HEADER of `sink`, which is the
     * plugin's own. `rows` may be nil: there are as many points as the batches have. Returns
     * SURFELSHOP_END after the last cloud.
     */
    int32_t (*next_cloud)(void *context, surfelshop_sink sink);
    /**
     * Puts the next points of the cloud into `batch`, whose columns are those of the header in the
     * same order. They stay until the next call of this structure. Positions are SURFELSHOP_F64 and
     * relative to zero. Triangles come with the last batch, which may have no points. Returns
     * SURFELSHOP_END after the last.
     */
    int32_t (*next_batch)(void *context, surfelshop_cloud *batch, surfelshop_sink sink);
} surfelshop_cloud_source;

/**
 * The functions of formats, exported as SURFELSHOP_FORMATS beside the table of all units, which makes
 * and ends their instances: one for each file. Neither may be NULL; a format that is only read has
 * surfelshop_no_write. What is said of the functions of that table holds for these.
 *
 * A format opens no file. While it works it reads, hands over or tells progress at least every 20
 * seconds, or it is given up. ABI 3.8.
 */
typedef struct surfelshop_format_table {
    /** Head of the table: SURFELSHOP_FORMATS_HEAD fills these four. */
    uint8_t magic[8];
    uint32_t size;
    uint16_t abi_major;
    uint16_t abi_minor;
    /**
     * Reads the clouds of a file. `request` is {"values": {...}, "columns": nil or [...]}: the
     * parameters, a map as in a frame's request, and the names of the columns that somebody reads,
     * all where it is nil: others may be left out of the header. Where it has "nodes", a format that
     * knows an octree in the file puts it into the header as "tree" (host/sdk/api/src/format/tree.rs),
     * and hands over the points of these nodes alone; others need not look at it.
     */
    int32_t (*read)(void *instance, surfelshop_bytes request, const surfelshop_file *file,
                    const surfelshop_cloud_sink *clouds, const surfelshop_job *job,
                    surfelshop_sink sink);
    /**
     * Writes clouds to a file, which is empty at first. `values` are the parameters. What the format
     * cannot hold goes to SURFELSHOP_CHANNEL_LINES. Where this fails, no file is left behind.
     */
    int32_t (*write)(void *instance, surfelshop_bytes values,
                     const surfelshop_cloud_source *clouds, const surfelshop_file *file,
                     const surfelshop_job *job, surfelshop_sink sink);
} surfelshop_format_table;

/* A compiler that lays these out in another way would make a plugin the host cannot read. */
SURFELSHOP_ASSERT(tile_layout, sizeof(surfelshop_tile) == 20);
SURFELSHOP_ASSERT(table_layout, sizeof(surfelshop_plugin_table) == 16 + 6 * sizeof(void *));
SURFELSHOP_ASSERT(column_layout, sizeof(void *) != 8 || sizeof(surfelshop_column) == 48);
SURFELSHOP_ASSERT(cloud_layout, sizeof(void *) != 8 || sizeof(surfelshop_cloud) == 128);
SURFELSHOP_ASSERT(file_layout, sizeof(surfelshop_file) == 6 * sizeof(void *));
SURFELSHOP_ASSERT(cloud_sink_layout, sizeof(surfelshop_cloud_sink) == 5 * sizeof(void *));
SURFELSHOP_ASSERT(cloud_source_layout, sizeof(surfelshop_cloud_source) == 3 * sizeof(void *));
SURFELSHOP_ASSERT(format_table_layout, sizeof(surfelshop_format_table) == 16 + 2 * sizeof(void *));

/** The first four members of a surfelshop_plugin_table. */
#define SURFELSHOP_TABLE_HEAD \
    {'S', 'U', 'R', 'F', 'E', 'L', 'P', 0}, (uint32_t)sizeof(surfelshop_plugin_table), \
        SURFELSHOP_ABI_MAJOR, SURFELSHOP_ABI_MINOR

/** The first four members of a surfelshop_format_table. */
#define SURFELSHOP_FORMATS_HEAD \
    {'S', 'U', 'R', 'F', 'E', 'L', 'F', 0}, (uint32_t)sizeof(surfelshop_format_table), \
        SURFELSHOP_ABI_MAJOR, SURFELSHOP_ABI_MINOR

/**
 * Defines the exported manifest from a string literal of lines, each a key, its values with a tab
 * before each, and a line feed, in UTF-8 without other control characters:
 *
 *     id        reverse-DNS id of the package, such as org.example.mine
 *     version   version of the package
 *     authors   separated by colons; may be empty or left out
 *     license   licence expression; may be empty or left out
 *     renderer  id, title and a sentence; likewise `tracer`, `tool` and `format`, one line for each
 *               unit, in the order of their numbers. Ids have a-z, 0-9 and -.
 *
 * Behind the line of a format, and of it alone:
 *
 *     ending    an ending of its files, 1 to 16 of a-z, 0-9, -, _ and ., without the dot before it;
 *               a line for each
 *     magic     bytes that its files have: their offset, and two hexadecimal digits for each, within
 *               the first 64 bytes; a line for each, any of which tells the format
 *     written   no value: it writes files, too
 *     several   no value: it writes several clouds with their poses; else all come as one
 *
 * Goes once into a library, at file scope, with a semicolon. The host reads the object out of the
 * file, so it holds nothing but bytes; the zero that ends the literal is behind the stated length.
 */
#if defined(__wasm__)
#include <stdlib.h>

/** Sets memory aside for what the host lends, so that it is no allocator's. */
__attribute__((weak, export_name("surfelshop_alloc"))) void *surfelshop_alloc(size_t len)
{
    return malloc(len);
}

/*
 * A sandboxed plugin imports nothing. Where its C library formats text it names the system's files, too, which are
 * never written: these take their place, and the linker needs no import.
 */
__attribute__((weak)) int __imported_wasi_snapshot_preview1_fd_close(int file)
{
    (void)file;
    return 8;
}
__attribute__((weak)) int __imported_wasi_snapshot_preview1_fd_seek(int file, int64_t by, int from,
                                                                    int out)
{
    (void)file, (void)by, (void)from, (void)out;
    return 8;
}
__attribute__((weak)) int __imported_wasi_snapshot_preview1_fd_write(int file, int parts, int n,
                                                                     int out)
{
    (void)file, (void)parts, (void)n, (void)out;
    return 8;
}

/* In a custom section, which hosts read without running anything. The text is the assembler's to count. */
#define SURFELSHOP_TEXT_OF(...) #__VA_ARGS__
#define SURFELSHOP_WRITTEN(...) SURFELSHOP_TEXT_OF(__VA_ARGS__)
#define SURFELSHOP_MANIFEST_OF(...) \
    __asm__(".section .custom_section.surfelshop.manifest,\"\",@\n" \
            ".ascii \"SURFELSHOP-PLUG\\n\"\n" \
            ".int16 " SURFELSHOP_WRITTEN(SURFELSHOP_ABI_MAJOR) "\n" \
            ".int16 " SURFELSHOP_WRITTEN(SURFELSHOP_ABI_MINOR) "\n" \
            ".int32 .Lsurfelshop_end-.Lsurfelshop_text\n" \
            ".Lsurfelshop_text:\n" \
            ".ascii " #__VA_ARGS__ "\n" \
            ".Lsurfelshop_end:\n" \
            ".section .text,\"\",@\n"); \
    extern const int surfelshop_manifest_is_a_section
#else
#define SURFELSHOP_MANIFEST_OF(lines) \
    typedef struct surfelshop_manifest { \
        uint8_t magic[16]; \
        uint8_t abi[4]; \
        uint8_t len[4]; \
        char text[sizeof(lines)]; \
    } surfelshop_manifest; \
    SURFELSHOP_ASSERT(manifest_layout, sizeof(surfelshop_manifest) == 24 + sizeof(lines)); \
    SURFELSHOP_ASSERT(manifest_length, sizeof(lines) - 1 <= (size_t)1 << 20); \
    SURFELSHOP_EXPORT const surfelshop_manifest SURFELSHOP_MANIFEST = { \
        {'S', 'U', 'R', 'F', 'E', 'L', 'S', 'H', 'O', 'P', '-', 'P', 'L', 'U', 'G', '\n'}, \
        {SURFELSHOP_ABI_MAJOR & 255, SURFELSHOP_ABI_MAJOR >> 8, \
         SURFELSHOP_ABI_MINOR & 255, SURFELSHOP_ABI_MINOR >> 8}, \
        {(sizeof(lines) - 1) & 255, (sizeof(lines) - 1) >> 8 & 255, \
         (sizeof(lines) - 1) >> 16 & 255, (sizeof(lines) - 1) >> 24 & 255}, \
        lines}
#endif

/** Writes `len` bytes to a channel; the caller keeps them. */
static inline void surfelshop_write(surfelshop_sink sink, uint32_t channel, const void *from,
                                    size_t len)
{
    surfelshop_bytes bytes;
    bytes.ptr = (const uint8_t *)from;
    bytes.len = len;
    sink.write(sink.context, channel, bytes);
}

/** Writes a line to the error channel and returns SURFELSHOP_ERROR, to be returned in turn. */
static inline int32_t surfelshop_fail(surfelshop_sink sink, const char *line)
{
    surfelshop_write(sink, SURFELSHOP_CHANNEL_ERROR, line, strlen(line));
    return SURFELSHOP_ERROR;
}

/** Takes the place of `frame` in plugins without renderers. */
static inline int32_t surfelshop_no_frame(void *instance, surfelshop_bytes request,
                                          surfelshop_sink sink)
{
    (void)instance, (void)request;
    return surfelshop_fail(sink, "this unit is not a renderer");
}

/** Takes the place of `tile` in plugins without tracers. */
static inline int32_t surfelshop_no_tile(const void *instance, surfelshop_bytes request,
                                         const surfelshop_cloud *clouds, size_t n_clouds,
                                         const float (*texels)[3], size_t n_texels,
                                         const surfelshop_tile *tile, float *pixels,
                                         size_t n_floats, const surfelshop_job *job,
                                         surfelshop_sink sink)
{
    (void)instance, (void)request, (void)clouds, (void)n_clouds, (void)texels, (void)n_texels;
    (void)tile, (void)pixels, (void)n_floats, (void)job;
    return surfelshop_fail(sink, "this unit is not a tracer");
}

/** Takes the place of `run` in plugins without tools. */
static inline int32_t surfelshop_no_run(void *instance, surfelshop_bytes values,
                                        const surfelshop_cloud *cloud, const surfelshop_job *job,
                                        surfelshop_sink sink)
{
    (void)instance, (void)values, (void)cloud, (void)job;
    return surfelshop_fail(sink, "this unit is not a tool");
}

/** Takes the place of `write` in plugins whose formats are only read. */
static inline int32_t surfelshop_no_write(void *instance, surfelshop_bytes values,
                                          const surfelshop_cloud_source *clouds,
                                          const surfelshop_file *file, const surfelshop_job *job,
                                          surfelshop_sink sink)
{
    (void)instance, (void)values, (void)clouds, (void)file, (void)job;
    return surfelshop_fail(sink, "this format is only read");
}

#ifdef __cplusplus
}
#endif

#endif
