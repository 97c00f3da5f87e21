/*
 * xyzb.c: a file format for Surfelshop in C, which reads and writes points with colours.
 *
 *     cc -shared -fPIC -O2 -o libxyzb_c.so xyzb.c -lm
 *
 * It is the twin of the project that `surfelshop plugins new xyzb --kind format` makes, which is written
 * in Rust: both write the same bytes. It opens no file. The host lends it the bytes of one, and takes
 * or lends clouds in batches. A file .xyzb has, without gaps and with the least significant byte of each
 * number first:
 *
 *     a first line    "points xyzb 1", which tells the format apart
 *     8 bytes         how many points follow
 *     27 a point      x, y, z (double each), red, green, blue (one byte each, sRGB)
 *
 *     parameter   type     default    meaning
 *     up          choice   unknown    the axis that points up in a file: x, y or z
 *
 * Licence: MIT OR Apache-2.0.
 */
#include "surfelshop.h"
#include "surfelshop_msgpack.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>

/* The host finds the format by its lines: "points xyzb 1" and a line feed, and then the ending. */
SURFELSHOP_MANIFEST_OF(
    "id\torg.example.xyzb-c\n"
    "version\t0.1.0\n"
    "authors\t\n"
    "license\tMIT OR Apache-2.0\n"
    "format\txyzb-c\tXyzb in C\tPoints with colours in a simple file.\n"
    "ending\txyzb\n"
    "magic\t0\t706f696e74732078797a6220310a\n"
    "written\n");

/* One unit is in the manifest, so it is number 0. */
#define XYZB 0

static const char FIRST_LINE[] = "points xyzb 1\n";
/* Where the number of points stands, and where the first point begins. */
#define COUNT_AT (sizeof FIRST_LINE - 1)
#define POINTS_AT (COUNT_AT + 8)
/* Bytes of a place, and of a point. */
#define PLACE_LEN 24
#define POINT_LEN (PLACE_LEN + 3)
/* Points that are read or written at once. */
#define BATCH 65536

/* The choices of the parameter, which are the words of a header, too; the first is the default. */
static const char *const UP[] = {"unknown", "x", "y", "z"};
#define N_UP (sizeof UP / sizeof UP[0])

/** A batch as the file has it, and as the host takes it. */
typedef struct buffers {
    uint8_t bytes[BATCH * POINT_LEN];
    double places[3 * BATCH];
    uint8_t colors[3 * BATCH];
} buffers;

static uint64_t get_u64(const uint8_t *bytes)
{
    uint64_t number = 0;
    for (int i = 0; i < 8; i++)
        number |= (uint64_t)bytes[i] << 8 * i;
    return number;
}

static void put_u64(uint8_t *bytes, uint64_t number)
{
    for (int i = 0; i < 8; i++)
        bytes[i] = (uint8_t)(number >> 8 * i);
}

static surfelshop_bytes lent(const void *from, size_t len)
{
    surfelshop_bytes bytes = {(const uint8_t *)from, len};
    return bytes;
}

static int32_t no_such_unit(uint32_t unit, surfelshop_sink sink)
{
    char line[80];
    snprintf(line, sizeof line, "unit %lu was asked for, the plugin has 1", (unsigned long)unit);
    return surfelshop_fail(sink, line);
}

/** Writes a message to the host's sink and frees it. */
static int32_t deliver(sm_builder *b, uint32_t channel, surfelshop_sink sink)
{
    int failed = b->failed;
    if (!failed)
        surfelshop_write(sink, channel, b->bytes, b->len);
    sm_free(b);
    return failed ? surfelshop_fail(sink, "out of memory") : SURFELSHOP_OK;
}

static int32_t describe(uint32_t unit, surfelshop_sink sink)
{
    sm_builder b = sm_start();
    if (unit != XYZB)
        return no_such_unit(unit, sink);
    sm_map(&b, 2);
    sm_str(&b, "params"), sm_array(&b, 1), sm_map(&b, 4);
    sm_str(&b, "id"), sm_str(&b, "up");
    sm_str(&b, "kind"), sm_map(&b, 1), sm_str(&b, "Choice"), sm_array(&b, N_UP);
    for (size_t i = 0; i < N_UP; i++)
        sm_str(&b, UP[i]);
    sm_str(&b, "default"), sm_map(&b, 1), sm_str(&b, "Text"), sm_str(&b, UP[0]);
    sm_str(&b, "doc"), sm_str(&b, "The axis that points up in a file.");
    sm_str(&b, "limits"), sm_array(&b, 0);
    return deliver(&b, SURFELSHOP_CHANNEL_DESCRIPTION, sink);
}

static int32_t create(uint32_t unit, surfelshop_bytes host, void **out, surfelshop_sink sink)
{
    /* Nothing is kept from call to call, so this, which holds nothing, is every instance. */
    static char stateless;
    (void)host;
    if (unit != XYZB)
        return no_such_unit(unit, sink);
    *out = &stateless;
    return SURFELSHOP_OK;
}

static int32_t destroy(void *instance, surfelshop_sink sink)
{
    (void)instance, (void)sink;
    return SURFELSHOP_OK;
}

/**
 * Finds out how many points can be read: as many as the file announces, where it has room for them. A
 * number in a file may be any, so what follows from it is held against the file's length first.
 */
static int32_t count(const surfelshop_file *file, const surfelshop_cloud_sink *clouds,
                     uint64_t *n_points, surfelshop_sink sink)
{
    uint8_t head[POINTS_AT];
    size_t found;
    int32_t status = file->read_at(file->context, 0, head, sizeof head, &found, sink);
    if (status != SURFELSHOP_OK)
        return status;
    if (found < sizeof head || memcmp(head, FIRST_LINE, COUNT_AT) != 0)
        return surfelshop_fail(sink, "expected a first line `points xyzb 1`, found another");
    uint64_t announced = get_u64(head + COUNT_AT);
    uint64_t length = file->length(file->context);
    uint64_t rest = length > POINTS_AT ? length - POINTS_AT : 0;
    uint64_t there = rest / POINT_LEN;
    char line[160] = "";
    if (announced > there)
        snprintf(line, sizeof line,
                 "%" PRIu64 " points are announced, %" PRIu64 " are there: the file is cut short",
                 announced, there);
    else if (rest > announced * POINT_LEN)
        snprintf(line, sizeof line, "the bytes behind the last point were left out");
    if (line[0] != 0)
        clouds->warn(clouds->context, lent(line, strlen(line)));
    *n_points = announced < there ? announced : there;
    return SURFELSHOP_OK;
}

/** Whether somebody reads a column: everybody reads all where there is no list. */
static int wants(sm_value columns, const char *name)
{
    sm_head list = sm_read(columns);
    if (list.kind != SM_ARRAY)
        return 1;
    columns.at = list.body;
    for (uint64_t left = list.number; left > 0 && columns.at != NULL; left--) {
        if (sm_is(columns, name))
            return 1;
        columns = sm_after(columns);
    }
    return 0;
}

/** The axis that was set, or the default. */
static const char *up_axis(sm_value values)
{
    sm_value set = sm_find(sm_find(values, "up"), "Text");
    for (size_t i = 0; i < N_UP; i++)
        if (sm_is(set, UP[i]))
            return UP[i];
    return UP[0];
}

static void put_column(sm_builder *b, const char *name, const char *element)
{
    sm_map(b, 3);
    sm_str(b, "name"), sm_str(b, name);
    sm_str(b, "components"), sm_u64(b, 3);
    sm_str(b, "element"), sm_str(b, element);
}

/** Says what is in the file: SURFELSHOP_END where the host wants no more of it. */
static int32_t begin(const surfelshop_cloud_sink *clouds, uint64_t n_points, const char *up,
                     size_t n_columns, surfelshop_sink sink)
{
    sm_builder b = sm_start();
    sm_map(&b, 4);
    sm_str(&b, "format"), sm_str(&b, "Xyzb, version 1");
    sm_str(&b, "rows"), sm_u64(&b, n_points);
    sm_str(&b, "columns"), sm_array(&b, (uint32_t)n_columns);
    put_column(&b, "position", "f64");
    if (n_columns > 1)
        put_column(&b, "color", "u8");
    sm_str(&b, "up"), sm_str(&b, up);
    int32_t status = b.failed ? surfelshop_fail(sink, "out of memory")
                              : clouds->begin(clouds->context, lent(b.bytes, b.len), sink);
    sm_free(&b);
    return status;
}

/** Reads `n` points from an offset and takes them apart. */
static int32_t unpack(const surfelshop_file *file, uint64_t offset, size_t n, buffers *batch,
                      surfelshop_sink sink)
{
    size_t found;
    int32_t status =
        file->read_at(file->context, offset, batch->bytes, n * POINT_LEN, &found, sink);
    if (status != SURFELSHOP_OK)
        return status;
    if (found < n * POINT_LEN)
        return surfelshop_fail(sink, "the file became shorter while it was read");
    for (size_t i = 0; i < n; i++) {
        const uint8_t *point = batch->bytes + i * POINT_LEN;
        for (size_t axis = 0; axis < 3; axis++) {
            uint64_t bits = get_u64(point + 8 * axis);
            memcpy(&batch->places[3 * i + axis], &bits, sizeof bits);
        }
        memcpy(batch->colors + 3 * i, point + PLACE_LEN, 3);
    }
    return SURFELSHOP_OK;
}

static int32_t read_file(void *instance, surfelshop_bytes request, const surfelshop_file *file,
                         const surfelshop_cloud_sink *clouds, const surfelshop_job *job,
                         surfelshop_sink sink)
{
    sm_value call = sm_open(request.ptr, request.len);
    const char *up = up_axis(sm_find(call, "values"));
    /* What nobody reads is not announced, and then not handed over either. */
    size_t n_columns = wants(sm_find(call, "columns"), "color") ? 2 : 1;
    uint64_t n_points;
    (void)instance;
    /* Whatever the host says of its functions is handed on: its lines are in `sink` already. */
    int32_t status = count(file, clouds, &n_points, sink);
    if (status == SURFELSHOP_OK)
        status = begin(clouds, n_points, up, n_columns, sink);
    if (status != SURFELSHOP_OK)
        return status == SURFELSHOP_END ? SURFELSHOP_OK : status;
    buffers *batch = (buffers *)malloc(sizeof *batch);
    if (batch == NULL)
        return surfelshop_fail(sink, "out of memory");
    for (uint64_t done = 0; done < n_points && status == SURFELSHOP_OK;) {
        size_t n = n_points - done < BATCH ? (size_t)(n_points - done) : BATCH;
        status = job->cancelled(job->context)
                     ? surfelshop_fail(sink, "cancelled")
                     : unpack(file, POINTS_AT + done * POINT_LEN, n, batch, sink);
        if (status != SURFELSHOP_OK)
            break;
        surfelshop_bytes values[2];
        values[0] = lent(batch->places, n * PLACE_LEN);
        values[1] = lent(batch->colors, n * 3);
        status = clouds->batch(clouds->context, values, n_columns, sink);
        done += n;
        job->progress(job->context, (double)done / (double)n_points, lent(NULL, 0));
    }
    free(batch);
    return status;
}

static const surfelshop_column *find_column(const surfelshop_cloud *cloud, const char *name)
{
    for (size_t i = 0; i < cloud->n_columns; i++) {
        surfelshop_bytes other = cloud->columns[i].name;
        if (other.len == strlen(name) && memcmp(other.ptr, name, other.len) == 0)
            return &cloud->columns[i];
    }
    return NULL;
}

/** Encodes linear light as sRGB, IEC 61966-2-1. */
static uint8_t encode(float linear)
{
    float encoded = 255.0f * (linear <= 0.0031308f ? linear * 12.92f
                                                   : 1.055f * powf(linear, 1.0f / 2.4f) - 0.055f);
    if (!(encoded > 0.0f))
        return 0;
    return encoded < 255.0f ? (uint8_t)roundf(encoded) : 255;
}

/** A channel of a point's colour, whatever type it has; grey where there is none. */
static uint8_t channel(const surfelshop_column *color, size_t point, size_t i)
{
    if (color == NULL || color->components < 3)
        return 188;
    size_t place = point * color->components + i;
    switch (color->element) {
    case SURFELSHOP_U8: return ((const uint8_t *)color->values)[place];
    case SURFELSHOP_U16: return (uint8_t)((((const uint16_t *)color->values)[place] + 128) / 257);
    case SURFELSHOP_F32: return encode(((const float *)color->values)[place]);
    default: return 188;
    }
}

/** Writes the points of a batch at an offset, as many at once as the buffer holds. */
static int32_t pack(const surfelshop_file *file, uint64_t offset, const surfelshop_cloud *points,
                    buffers *batch, surfelshop_sink sink)
{
    const surfelshop_column *place = find_column(points, "position");
    const surfelshop_column *color = find_column(points, "color");
    if (place == NULL || place->element != SURFELSHOP_F64 || place->components != 3)
        return surfelshop_fail(sink, "expected a column `position` of f64, found none");
    int32_t status = SURFELSHOP_OK;
    for (size_t done = 0; done < points->len && status == SURFELSHOP_OK;) {
        size_t n = points->len - done < BATCH ? points->len - done : BATCH;
        for (size_t i = 0; i < n; i++) {
            uint8_t *point = batch->bytes + i * POINT_LEN;
            for (size_t axis = 0; axis < 3; axis++) {
                uint64_t bits;
                memcpy(&bits, (const double *)place->values + 3 * (done + i) + axis, sizeof bits);
                put_u64(point + 8 * axis, bits);
                point[PLACE_LEN + axis] = channel(color, done + i, axis);
            }
        }
        status = file->write_at(file->context, offset + done * POINT_LEN,
                                lent(batch->bytes, n * POINT_LEN), sink);
        done += n;
    }
    return status;
}

/** Takes the header that the host writes; what else it writes is why it fails, and goes on. */
typedef struct header_sink {
    surfelshop_sink host;
    sm_builder header;
} header_sink;

static void take_header(void *context, uint32_t where, surfelshop_bytes bytes)
{
    header_sink *taken = (header_sink *)context;
    if (where != SURFELSHOP_CHANNEL_HEADER) {
        taken->host.write(taken->host.context, where, bytes);
        return;
    }
    taken->header.len = 0;
    sm_raw(&taken->header, bytes.ptr, bytes.len);
}

/** Lines of what a header says beside columns, for which the file has no place. */
static void put_lost_facts(sm_builder *lines, uint32_t *n, sm_value header)
{
    static const char *const facts[][2] = {
        {"name", "the name of the cloud"},
        {"coordinate_system", "the coordinate reference system"},
        {"time", "the time"},
        {"scanner", "the place of the scanner"},
        {"grid", "the rows and columns of the grid"},
        {"comments", "comments"},
    };
    double metres = 0.0;
    for (size_t i = 0; i < sizeof facts / sizeof facts[0]; i++) {
        size_t len = 0;
        sm_value fact = sm_find(header, facts[i][0]);
        char line[100];
        /* A text that is not empty, or a list that is not. */
        if ((sm_text(fact, &len) == NULL || len == 0) && sm_count(fact) == 0)
            continue;
        snprintf(line, sizeof line, "the file has no place for %s", facts[i][1]);
        sm_str(lines, line), ++*n;
    }
    if (sm_number(sm_find(header, "metres_per_unit"), &metres) && metres > 0.0 && metres != 1.0)
        sm_str(lines, "the file has no place for the unit"), ++*n;
    if (sm_is(sm_find(header, "up"), "z") || sm_is(sm_find(header, "up"), "x"))
        sm_str(lines, "the file does not say which axis points up: read it with `--up`"), ++*n;
}

/** Lines of what the file cannot hold of a cloud; `n` counts them. */
static void put_lost(sm_builder *lines, uint32_t *n, sm_value header)
{
    sm_value column = sm_find(header, "columns"), triangles = sm_find(header, "has_faces");
    uint64_t left = sm_count(column);
    double has_triangles = 0.0;
    int has_color = 0;
    column.at = sm_read(column).body;
    for (; left > 0 && column.at != NULL; left--) {
        size_t len;
        const char *name = sm_text(sm_find(column, "name"), &len);
        int is_color = sm_is(sm_find(column, "name"), "color");
        int is_left_out = name != NULL && !is_color && !sm_is(sm_find(column, "name"), "position");
        char line[300];
        has_color |= is_color;
        snprintf(line, sizeof line, "`%.*s` was left out", (int)len, name != NULL ? name : "");
        if (is_color && !sm_is(sm_find(column, "element"), "u8"))
            sm_str(lines, "colours were rounded to 8 bits"), ++*n;
        else if (is_left_out)
            sm_str(lines, line), ++*n;
        column = sm_after(column);
    }
    if (!has_color)
        sm_str(lines, "there are no colours: all points are grey"), ++*n;
    if (sm_number(triangles, &has_triangles) && has_triangles != 0.0)
        sm_str(lines, "triangles were left out"), ++*n;
    put_lost_facts(lines, n, header);
}

/** Writes the points of all clouds behind one another, and counts them. */
static int32_t write_clouds(const surfelshop_cloud_source *clouds, const surfelshop_file *file,
                            const surfelshop_job *job, buffers *batch, header_sink *taken,
                            sm_builder *lines, uint32_t *n_lines, uint64_t *n_points)
{
    surfelshop_sink own = {taken, take_header};
    surfelshop_cloud points;
    int32_t status;
    while ((status = clouds->next_cloud(clouds->context, own)) == SURFELSHOP_OK) {
        put_lost(lines, n_lines, sm_open(taken->header.bytes, taken->header.len));
        while ((status = clouds->next_batch(clouds->context, &points, own)) == SURFELSHOP_OK) {
            if (job->cancelled(job->context))
                return surfelshop_fail(own, "cancelled");
            if (points.len == 0)
                continue; /* Triangles alone. */
            status = pack(file, POINTS_AT + *n_points * POINT_LEN, &points, batch, own);
            if (status != SURFELSHOP_OK)
                return status;
            *n_points += points.len;
        }
        if (status != SURFELSHOP_END)
            return status;
    }
    return status == SURFELSHOP_END ? SURFELSHOP_OK : status;
}

static int32_t write_file(void *instance, surfelshop_bytes values,
                          const surfelshop_cloud_source *clouds, const surfelshop_file *file,
                          const surfelshop_job *job, surfelshop_sink sink)
{
    header_sink taken = {sink, sm_start()};
    sm_builder lines = sm_start(), message = sm_start();
    uint8_t head[POINTS_AT] = {0}, count_bytes[8];
    uint64_t n_points = 0;
    uint32_t n_lines = 0;
    (void)instance, (void)values;
    buffers *batch = (buffers *)malloc(sizeof *batch);
    if (batch == NULL)
        return surfelshop_fail(sink, "out of memory");
    /* How many points there are shows when they have come. Until then the file says none. */
    memcpy(head, FIRST_LINE, COUNT_AT);
    int32_t status = file->write_at(file->context, 0, lent(head, sizeof head), sink);
    if (status == SURFELSHOP_OK)
        status = write_clouds(clouds, file, job, batch, &taken, &lines, &n_lines, &n_points);
    put_u64(count_bytes, n_points);
    if (status == SURFELSHOP_OK)
        status = file->write_at(file->context, COUNT_AT, lent(count_bytes, 8), sink);
    if (status == SURFELSHOP_OK) {
        sm_array(&message, n_lines);
        sm_raw(&message, lines.bytes, lines.len);
        message.failed |= lines.failed;
        status = deliver(&message, SURFELSHOP_CHANNEL_LINES, sink);
    }
    sm_free(&lines);
    sm_free(&taken.header);
    free(batch);
    return status;
}

SURFELSHOP_EXPORT const surfelshop_plugin_table SURFELSHOP_PLUGIN = {
    SURFELSHOP_TABLE_HEAD,
    describe,
    create,
    destroy,
    surfelshop_no_frame,
    surfelshop_no_tile,
    surfelshop_no_run,
};

SURFELSHOP_EXPORT const surfelshop_format_table SURFELSHOP_FORMATS = {
    SURFELSHOP_FORMATS_HEAD,
    read_file,
    write_file,
};
