/*
 * gaussians.c: a renderer for Surfelshop in C that draws Gaussian splats (3DGS).
 *
 *     cc -shared -fPIC -O2 -o libgaussians_c.so gaussians.c
 *
 * It says which columns a cloud must have, has the host bring columns to the device, and describes a pass
 * of splats: one function of WGSL that says what each Gaussian looks like. The host sorts and blends them.
 * Its picture is that of the built-in renderer `gaussians` with `order=0`.
 *
 *     parameter   type    default                meaning
 *     size        float   1, from 0.01 to 4      factor on the size of every Gaussian
 *
 * Source: Kerbl et al. 2023, "3D Gaussian Splatting for Real-Time Radiance Field Rendering".
 * Licence: MIT OR Apache-2.0.
 */
#include "surfelshop.h"
#include "surfelshop_msgpack.h"

#include <math.h>
#include <stdio.h>

/*
 * A line `need` names a column that a renderer cannot do without, and its least number of components in
 * four digits: so the host offers it for clouds that have it.
 */
SURFELSHOP_MANIFEST_OF(
    "id\torg.example.gaussians-c\n"
    "version\t0.1.0\n"
    "authors\t\n"
    "license\tMIT OR Apache-2.0\n"
    "renderer\tgaussians-c\tGaussians in C\tGaussians in space, in one colour for all directions.\n"
    "need\tsplat_scale\t0002\n"
    "need\tsplat_rotation\t0004\n");

/* One unit is in the manifest, so it is number 0. */
#define GAUSSIANS 0

#define SIZE_DEFAULT 1.0
#define SIZE_LOW 0.01
#define SIZE_HIGH 4.0

/** A column: what is read of it, and whether a cloud is of no use without it. */
typedef struct column {
    const char *name;
    unsigned components;
    float otherwise;
    /** Least components that a cloud has to have; 0 where it may do without the column. */
    unsigned needed;
    /** What its values are, so that they follow where a cloud is placed: a Role. */
    const char *role;
} column;

/* The role of harmonics, which names their order besides: those of order 0 have no direction. */
#define HARMONICS "spherical-harmonics"

/* They lie behind one another in the buffer, a word for each value. */
static const column COLUMNS[] = {
    {"position", 3, 0.0f, 3, "plain"},
    {"splat_scale", 3, 0.0f, 2, "length"},
    {"splat_rotation", 4, 0.0f, 4, "quaternion"},
    {"opacity", 1, 1.0f, 0, "plain"},
    {"sh_0", 3, 0.0f, 0, HARMONICS},
};
#define N_COLUMNS (sizeof COLUMNS / sizeof COLUMNS[0])
#define WORDS_OF_A_SURFEL 14
#define WORDS_BEFORE_THE_FIRST 4

/* The host calls `draw` for each surfel. `words[0]` is the number of the first one in the buffer. */
static const char SPLAT[] =
    "#import surfelshop::splat\n"
    "#import surfelshop::sh\n"
    "\n"
    "struct Settings { size: f32 }\n"
    "var<uniform> settings: Settings;\n"
    "var<storage, read> words: array<u32>;\n"
    "\n"
    "fn value(i: u32, k: u32) -> f32 {\n"
    "    return bitcast<f32>(words[4u + 14u * (i - words[0]) + k]);\n"
    "}\n"
    "\n"
    "fn vector(i: u32, k: u32) -> vec3<f32> {\n"
    "    return vec3(value(i, k), value(i, k + 1u), value(i, k + 2u));\n"
    "}\n"
    "\n"
    "fn turned(i: u32) -> mat3x3<f32> {\n"
    "    return splat::rotation(vec4(vector(i, 6u), value(i, 9u)));\n"
    "}\n"
    "\n"
    "fn footprint(i: u32) -> splat::Splat {\n"
    "    let axis = turned(i);\n"
    "    let scale = settings.size * vector(i, 3u);\n"
    "    let axes = mat3x3(axis[0] * scale.x, axis[1] * scale.y, axis[2] * scale.z);\n"
    "    var s = splat::gaussian(vector(i, 0u), axes, 0.3, false);\n"
    "    s.opacity *= value(i, 10u);\n"
    "    return s;\n"
    "}\n"
    "\n"
    "fn draw(i: u32) -> splat::Splat {\n"
    "    var s = footprint(i);\n"
    "    let color = vec3(0.5) + sh::ORDER_0 * vector(i, 11u);\n"
    "    s.payload[0] = vec4(clamp(color, vec3(0.0), vec3(65504.0)), 1.0);\n"
    "    return s;\n"
    "}\n"
    "\n"
    "// The axis along which it is flattest, turned to the eye.\n"
    "fn facing(i: u32) -> splat::Splat {\n"
    "    var s = footprint(i);\n"
    "    let axis = turned(i);\n"
    "    let scale = vector(i, 3u);\n"
    "    var normal = axis[2];\n"
    "    if scale.x < min(scale.y, scale.z) {\n"
    "        normal = axis[0];\n"
    "    } else if scale.y < scale.z {\n"
    "        normal = axis[1];\n"
    "    }\n"
    "    let away = dot(normal, splat::direction_to(vector(i, 0u))) > 0.0;\n"
    "    s.payload[0] = vec4(select(normal, -normal, away), 1.0);\n"
    "    return s;\n"
    "}\n";

/* Colours are trained and blended as pictures have them, sRGB-encoded; a picture's numbers are light. */
static const char RESOLVE[] =
    "// 1 where there are surfels beside the Gaussians; else nothing writes what is behind.\n"
    "override HAS_SURFACE: u32 = 0u;\n"
    "\n"
    "var sums: texture_2d<f32>;\n"
    "var behind: texture_2d<f32>;\n"
    "\n"
    "fn decoded(c: vec3<f32>) -> vec3<f32> {\n"
    "    return select(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, c <= vec3(0.04045));\n"
    "}\n"
    "\n"
    "fn encoded(c: vec3<f32>) -> vec3<f32> {\n"
    "    return select(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, c <= vec3(0.0031308));\n"
    "}\n"
    "\n"
    "@fragment\n"
    "fn resolve(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {\n"
    "    let sum = max(textureLoad(sums, vec2<u32>(at.xy), 0), vec4(0.0));\n"
    "    if HAS_SURFACE == 0u {\n"
    "        return vec4(decoded(sum.rgb), min(sum.w, 1.0));\n"
    "    }\n"
    "    let surface = max(textureLoad(behind, vec2<u32>(at.xy), 0), vec4(0.0));\n"
    "    let left = max(1.0 - sum.w, 0.0);\n"
    "    let shown = sum.rgb + left * encoded(surface.rgb);\n"
    "    return vec4(decoded(shown), min(sum.w, 1.0) + left * surface.w);\n"
    "}\n";

static const char NORMALS[] =
    "var sums: texture_2d<f32>;\n"
    "\n"
    "@fragment\n"
    "fn normal(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {\n"
    "    let sum = textureLoad(sums, vec2<u32>(at.xy), 0).xyz;\n"
    "    let there = length(sum) > 0.0;\n"
    "    return vec4(select(vec3(0.0), normalize(sum), there), select(0.0, 1.0, there));\n"
    "}\n";

/* Surfels beside the Gaussians: Lambert's law. */
static const char SURFACE[] =
    "#import surfelshop::surface::Surface\n"
    "#import surfelshop::light\n"
    "\n"
    "fn shade(s: Surface) -> vec4<f32> {\n"
    "    let arriving = light::diffuse_irradiance_at(s.position, s.normal) + 0.08;\n"
    "    return vec4(s.albedo * arriving, 1.0);\n"
    "}\n";

/** Writes a message to the host's sink and frees it. */
static int32_t deliver(sm_builder *b, uint32_t channel, surfelshop_sink sink)
{
    int failed = b->failed;
    if (!failed)
        surfelshop_write(sink, channel, b->bytes, b->len);
    sm_free(b);
    return failed ? surfelshop_fail(sink, "out of memory") : SURFELSHOP_OK;
}

static int32_t no_such_unit(uint32_t unit, surfelshop_sink sink)
{
    char line[80];
    snprintf(line, sizeof line, "unit %lu was asked for, the plugin has 1", (unsigned long)unit);
    return surfelshop_fail(sink, line);
}

static int32_t describe(uint32_t unit, surfelshop_sink sink)
{
    sm_builder b = sm_start();
    if (unit != GAUSSIANS)
        return no_such_unit(unit, sink);
    sm_map(&b, 2);
    sm_str(&b, "params"), sm_array(&b, 1), sm_map(&b, 5);
    sm_str(&b, "id"), sm_str(&b, "size");
    sm_str(&b, "kind"), sm_str(&b, "Float");
    sm_str(&b, "default"), sm_map(&b, 1), sm_str(&b, "Float"), sm_f64(&b, SIZE_DEFAULT);
    sm_str(&b, "range"), sm_array(&b, 2), sm_f64(&b, SIZE_LOW), sm_f64(&b, SIZE_HIGH);
    sm_str(&b, "doc"), sm_str(&b, "Factor on the size of every Gaussian.");

    /* All columns that are read, those that may be missing among them; the position is always there. */
    sm_str(&b, "needs"), sm_array(&b, N_COLUMNS - 1);
    for (size_t i = 1; i < N_COLUMNS; i++) {
        const column *c = &COLUMNS[i];
        sm_map(&b, 4);
        sm_str(&b, "column"), sm_str(&b, c->name);
        sm_str(&b, "role");
        if (strcmp(c->role, HARMONICS) == 0)
            sm_map(&b, 1), sm_str(&b, HARMONICS), sm_u64(&b, 0);
        else
            sm_str(&b, c->role);
        sm_str(&b, "components"), sm_u64(&b, c->needed ? c->needed : c->components);
        sm_str(&b, "required"), sm_bool(&b, c->needed > 0);
    }
    return deliver(&b, SURFELSHOP_CHANNEL_DESCRIPTION, sink);
}

static int32_t create(uint32_t unit, surfelshop_bytes host, void **out, surfelshop_sink sink)
{
    /* A frame depends on its request alone, so this, which holds nothing, is every instance. */
    static char stateless;
    (void)host;
    if (unit != GAUSSIANS)
        return no_such_unit(unit, sink);
    *out = &stateless;
    return SURFELSHOP_OK;
}

static int32_t destroy(void *instance, surfelshop_sink sink)
{
    (void)instance, (void)sink;
    return SURFELSHOP_OK;
}

/** The number that was set, brought into its range, or the default where none was. */
static float read_size(sm_value values)
{
    sm_value value = sm_find(values, "size");
    double number = NAN;
    /* Whole numbers may come as such. */
    if (!sm_number(sm_find(value, "Float"), &number))
        sm_number(sm_find(value, "Int"), &number);
    if (!isfinite(number))
        number = SIZE_DEFAULT;
    if (number < SIZE_LOW)
        number = SIZE_LOW;
    if (number > SIZE_HIGH)
        number = SIZE_HIGH;
    return (float)number;
}

/** Whether a cloud has a column of at least so many components. */
static int has_column(sm_value cloud, const column *wanted)
{
    sm_value columns = sm_find(cloud, "columns");
    for (uint64_t i = 0; i < sm_count(columns); i++) {
        sm_value found = sm_item(columns, i);
        double components = 0.0;
        if (sm_is(sm_find(found, "name"), wanted->name))
            return sm_number(sm_find(found, "components"), &components)
                && components >= wanted->needed;
    }
    return 0;
}

/** Whether a cloud is drawn as Gaussians. */
static int is_mine(sm_value cloud)
{
    for (size_t i = 0; i < N_COLUMNS; i++)
        if (COLUMNS[i].needed > 0 && !has_column(cloud, &COLUMNS[i]))
            return 0;
    return 1;
}

/** What is drawn of the clouds in view. */
typedef struct scene {
    sm_value clouds;
    /** Clouds that are Gaussians, and others. */
    uint32_t n_mine, n_others;
    uint64_t n_surfels;
} scene;

static scene read_scene(sm_value request)
{
    scene s = {sm_find(sm_find(request, "cloud"), "clouds"), 0, 0, 0};
    for (uint64_t i = 0; i < sm_count(s.clouds); i++) {
        sm_value cloud = sm_item(s.clouds, i);
        double n = 0.0;
        if (!is_mine(cloud)) {
            s.n_others++;
            continue;
        }
        s.n_mine++;
        /* Clouds have at most 2^32 surfels, which a double holds. */
        if (sm_number(sm_find(cloud, "n_surfels"), &n) && n > 0.0)
            s.n_surfels += (uint64_t)n;
    }
    return s;
}

/** Writes the numbers of the clouds that are Gaussians. */
static void put_mine(sm_builder *b, const scene *s)
{
    sm_array(b, s->n_mine);
    for (uint64_t i = 0; i < sm_count(s->clouds); i++)
        if (is_mine(sm_item(s->clouds, i)))
            sm_u64(b, i);
}

static void put_texture(sm_builder *b, const char *label, const char *format)
{
    sm_map(b, 4);
    sm_str(b, "label"), sm_str(b, label);
    sm_str(b, "format"), sm_str(b, format);
    sm_str(b, "extent"), sm_map(b, 1), sm_str(b, "View");
    sm_map(b, 1), sm_str(b, "divisor"), sm_u64(b, 1);
    sm_str(b, "lifetime"), sm_str(b, "Frame");
}

/* Textures and buffers are named by their position in their list. */
enum { SUMS, BEHIND, COLOR, FACING, NORMAL, DEPTH, N_TEXTURES };
static const char *const LABELS[N_TEXTURES] = {"sums", "surface", "color", "sums of normals",
                                               "normal", "depth"};
#define WORDS 0
#define SETTINGS 0

/** A variable that a texture is bound to. */
static void put_texture_binding(sm_builder *b, const char *variable, unsigned texture)
{
    sm_str(b, variable), sm_map(b, 1), sm_str(b, "Texture"), sm_map(b, 2);
    sm_str(b, "id"), sm_u64(b, texture);
    sm_str(b, "mip"), sm_nil(b);
}

/** What all passes begin with; `work`, `bindings` and `constants` follow. */
static void begin_pass(sm_builder *b, const char *name, const char *wgsl, const char *entry)
{
    sm_map(b, 6);
    sm_str(b, "name"), sm_str(b, name);
    sm_str(b, "wgsl"), sm_str(b, wgsl);
    sm_str(b, "entry"), sm_str(b, entry);
}

/** A pass of splats, into a texture and, where `depth` is one, into that. */
static void put_splats(sm_builder *b, const scene *s, const char *name, const char *entry,
                       unsigned target, unsigned depth)
{
    begin_pass(b, name, SPLAT, entry);
    sm_str(b, "work"), sm_map(b, 1), sm_str(b, "Splats"), sm_map(b, 6);
    sm_str(b, "n"), sm_u64(b, s->n_surfels);
    sm_str(b, "footprint"), sm_str(b, "conic");
    sm_str(b, "composition"), sm_str(b, "over");
    sm_str(b, "targets"), sm_array(b, 1), sm_u64(b, target);
    sm_str(b, "depths"), sm_array(b, depth < N_TEXTURES ? 1 : 0);
    if (depth < N_TEXTURES)
        sm_array(b, 2), sm_str(b, "median"), sm_u64(b, depth);
    sm_str(b, "tested"), sm_bool(b, s->n_others > 0);
    sm_str(b, "bindings"), sm_map(b, 2);
    sm_str(b, "words"), sm_map(b, 1), sm_str(b, "Buffer"), sm_u64(b, WORDS);
    sm_str(b, "settings"), sm_map(b, 1), sm_str(b, "Uniform"), sm_u64(b, SETTINGS);
    sm_str(b, "constants"), sm_map(b, 0);
}

/** The work of a pass that runs a fragment shader over a texture. */
static void put_fullscreen(sm_builder *b, unsigned target)
{
    sm_str(b, "work"), sm_map(b, 1), sm_str(b, "Fullscreen"), sm_map(b, 2);
    sm_str(b, "surface"), sm_str(b, "blended");
    sm_str(b, "targets"), sm_array(b, 1), sm_map(b, 3);
    sm_str(b, "texture"), sm_u64(b, target);
    sm_str(b, "mip"), sm_u64(b, 0);
    sm_str(b, "layer"), sm_u64(b, 0);
}

static void put_passes(sm_builder *b, const scene *s)
{
    sm_array(b, s->n_others > 0 ? 5 : 4);
    put_splats(b, s, "splats", "draw", SUMS, N_TEXTURES);
    if (s->n_others > 0) {
        begin_pass(b, "surface", SURFACE, "shade");
        sm_str(b, "work"), sm_map(b, 1), sm_str(b, "Shading"), sm_map(b, 2);
        sm_str(b, "surface"), sm_str(b, "blended");
        sm_str(b, "target"), sm_u64(b, BEHIND);
        sm_str(b, "bindings"), sm_map(b, 0);
        sm_str(b, "constants"), sm_map(b, 0);
    }
    begin_pass(b, "resolve", RESOLVE, "resolve");
    put_fullscreen(b, COLOR);
    sm_str(b, "bindings"), sm_map(b, 2);
    put_texture_binding(b, "sums", SUMS);
    put_texture_binding(b, "behind", BEHIND);
    sm_str(b, "constants"), sm_map(b, 1);
    sm_str(b, "HAS_SURFACE"), sm_f64(b, s->n_others > 0 ? 1.0 : 0.0);

    /* These run where somebody asks for their output. */
    put_splats(b, s, "normals and depths", "facing", FACING, DEPTH);
    begin_pass(b, "normal", NORMALS, "normal");
    put_fullscreen(b, NORMAL);
    sm_str(b, "bindings"), sm_map(b, 1);
    put_texture_binding(b, "sums", FACING);
    sm_str(b, "constants"), sm_map(b, 0);
}

static void put_output(sm_builder *b, const char *name, unsigned texture)
{
    sm_array(b, 2), sm_str(b, name), sm_u64(b, texture);
}

/** Writes the graph. */
static void put_structure(sm_builder *b, const scene *s)
{
    uint64_t words = WORDS_BEFORE_THE_FIRST + WORDS_OF_A_SURFEL * s->n_surfels;
    sm_map(b, 7);
    sm_str(b, "textures"), sm_array(b, N_TEXTURES);
    for (int i = 0; i < N_TEXTURES; i++)
        put_texture(b, LABELS[i], i == DEPTH ? "r32float" : "rgba32float");

    sm_str(b, "buffers"), sm_array(b, 1), sm_map(b, 4);
    sm_str(b, "label"), sm_str(b, "gaussians");
    sm_str(b, "size"), sm_u64(b, 4 * words);
    sm_str(b, "lifetime"), sm_str(b, "Frame");
    sm_str(b, "columns"), sm_map(b, 2);
    sm_str(b, "objects"), put_mine(b, s);
    sm_str(b, "columns"), sm_array(b, N_COLUMNS);
    for (size_t i = 0; i < N_COLUMNS; i++) {
        sm_map(b, 4);
        sm_str(b, "name"), sm_str(b, COLUMNS[i].name);
        sm_str(b, "components"), sm_u64(b, COLUMNS[i].components);
        sm_str(b, "stored"), sm_str(b, "f32");
        sm_str(b, "otherwise"), sm_f32(b, COLUMNS[i].otherwise);
    }

    sm_str(b, "uniforms"), sm_array(b, 1), sm_map(b, 2);
    sm_str(b, "offset"), sm_u64(b, 0);
    sm_str(b, "len"), sm_u64(b, 4);
    sm_str(b, "members"), sm_map(b, 1), sm_u64(b, SETTINGS), sm_array(b, 1);
    sm_map(b, 2), sm_str(b, "name"), sm_str(b, "size"), sm_str(b, "kind"), sm_str(b, "f32");

    sm_str(b, "passes"), put_passes(b, s);
    sm_str(b, "outputs"), sm_array(b, 3);
    put_output(b, "color", COLOR), put_output(b, "normal", NORMAL), put_output(b, "depth", DEPTH);
    /* Clouds that the host leaves out of its surface. */
    sm_str(b, "taken"), put_mine(b, s);
}

static int32_t frame(void *instance, surfelshop_bytes request, surfelshop_sink sink)
{
    sm_value opened = sm_open(request.ptr, request.len);
    sm_value values = sm_find(opened, "values");
    sm_builder structure = sm_start();
    scene s = read_scene(opened);
    float size = read_size(values);
    uint32_t bits;
    uint8_t data[4];
    (void)instance;
    if (sm_read(values).kind != SM_MAP)
        return surfelshop_fail(sink, "expected a frame's request with a map `values`, found none");
    memcpy(&bits, &size, sizeof bits);
    for (int k = 0; k < 4; k++)
        data[k] = (uint8_t)(bits >> 8 * k);
    surfelshop_write(sink, SURFELSHOP_CHANNEL_DATA, data, sizeof data);
    put_structure(&structure, &s);
    return deliver(&structure, SURFELSHOP_CHANNEL_STRUCTURE, sink);
}

SURFELSHOP_EXPORT const surfelshop_plugin_table SURFELSHOP_PLUGIN = {
    SURFELSHOP_TABLE_HEAD,
    describe,
    create,
    destroy,
    frame,
    surfelshop_no_tile,
    surfelshop_no_run,
};
