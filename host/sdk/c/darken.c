/*
 * darken.c: a tool in C that is led by hand over a cloud, a brush that lets less light reach surfels.
 *
 *     cc -shared -fPIC -O2 -o libdarken_c.so darken.c
 *
 * The host draws the cursor, follows the pointer, and finds the surfels along the stroke. `run` gets a
 * cloud of these alone, whose column "stroke_weight" says how much each is concerned, and answers with
 * a column of theirs. While the stroke goes on it runs again and again, from the beginning of the stroke
 * and on the cloud as it was before. ABI 3.11.
 *
 *     parameter   type    default                meaning
 *     strength    float   0.5, from 0 to 1       how dark it gets where the stroke is strongest
 *
 * Licence: MIT OR Apache-2.0.
 */
#include "surfelshop.h"
#include "surfelshop_msgpack.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

SURFELSHOP_MANIFEST_OF(
    "id\torg.example.darken-c\n"
    "version\t0.1.0\n"
    "authors\t\n"
    "license\tMIT OR Apache-2.0\n"
    "tool\tdarken-c\tDarken in C\tLets less light reach surfels along a stroke.\n"
    "handling\tstroke\n");

/* One unit is in the manifest, so it is number 0. */
#define DARKEN 0

#define STRENGTH_DEFAULT 0.5

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
    if (unit != DARKEN)
        return surfelshop_fail(sink, "another unit than 0 was asked for");
    sm_map(&b, 3);
    sm_str(&b, "params"), sm_array(&b, 1), sm_map(&b, 8);
    sm_str(&b, "id"), sm_str(&b, "strength");
    sm_str(&b, "kind"), sm_str(&b, "Float");
    sm_str(&b, "default"), sm_map(&b, 1), sm_str(&b, "Float"), sm_f64(&b, STRENGTH_DEFAULT);
    sm_str(&b, "range"), sm_array(&b, 2), sm_f64(&b, 0.0), sm_f64(&b, 1.0);
    sm_str(&b, "unit"), sm_str(&b, "");
    sm_str(&b, "doc"), sm_str(&b, "How dark it gets where the stroke is strongest.");
    sm_str(&b, "quality"), sm_bool(&b, 0);
    sm_str(&b, "logarithmic"), sm_bool(&b, 0);
    sm_str(&b, "limits"), sm_array(&b, 0);
    /* By a stroke of dabs a quarter of a radius apart, with a smooth edge, on the side that is seen. */
    sm_str(&b, "handling"), sm_map(&b, 1), sm_str(&b, "stroke"), sm_map(&b, 3);
    sm_str(&b, "spacing"), sm_f64(&b, 0.25);
    sm_str(&b, "falloff"), sm_str(&b, "smooth");
    sm_str(&b, "reach"), sm_str(&b, "facing");
    return deliver(&b, SURFELSHOP_CHANNEL_DESCRIPTION, sink);
}

static int32_t create(uint32_t unit, surfelshop_bytes host, void **out, surfelshop_sink sink)
{
    /* A run depends on what it gets alone, so this, which holds nothing, is every instance. */
    static char stateless;
    (void)host;
    if (unit != DARKEN)
        return surfelshop_fail(sink, "another unit than 0 was asked for");
    *out = &stateless;
    return SURFELSHOP_OK;
}

static int32_t destroy(void *instance, surfelshop_sink sink)
{
    (void)instance, (void)sink;
    return SURFELSHOP_OK;
}

/** A column of one float for each surfel; NULL where the cloud has none of that name. */
static const float *floats(const surfelshop_cloud *cloud, const char *name)
{
    for (size_t i = 0; i < cloud->n_columns; i++) {
        const surfelshop_column *column = &cloud->columns[i];
        int is_it = column->name.len == strlen(name) && column->name.len > 0
            && memcmp(column->name.ptr, name, column->name.len) == 0;
        if (is_it && column->element == SURFELSHOP_F32 && column->components == 1)
            return column->len == cloud->len ? (const float *)column->values : NULL;
    }
    return NULL;
}

/** The number that was set, brought into its range, or the default where none was. */
static float read_strength(sm_value values)
{
    double number = NAN;
    sm_value value = sm_find(values, "strength");
    if (!sm_number(sm_find(value, "Float"), &number))
        sm_number(sm_find(value, "Int"), &number);
    if (!isfinite(number))
        number = STRENGTH_DEFAULT;
    return (float)(number < 0.0 ? 0.0 : number > 1.0 ? 1.0 : number);
}

static int32_t run(void *instance, surfelshop_bytes call, const surfelshop_cloud *cloud,
                   const surfelshop_job *job, surfelshop_sink sink)
{
    /* {"values": {...}, "stroke": {...}}: this brush needs of the stroke only what is in the weights. */
    float strength = read_strength(sm_find(sm_open(call.ptr, call.len), "values"));
    const float *weights = floats(cloud, "stroke_weight"), *before = floats(cloud, "ao");
    float *ao;
    sm_builder header = sm_start();
    surfelshop_bytes values;
    int32_t status;
    (void)instance;
    if (cloud->len == 0)
        return SURFELSHOP_OK;
    if (!weights)
        return surfelshop_fail(sink, "expected a column `stroke_weight` of floats, found none");
    ao = (float *)malloc(cloud->len * sizeof *ao);
    if (!ao)
        return surfelshop_fail(sink, "out of memory");
    for (size_t i = 0; i < cloud->len; i++) {
        /* As the project of `plugins new --kind brush` does, bit by bit. */
        const float own = before ? before[i] : 1.0f;
        ao[i] = own + (0.0f - own) * weights[i] * strength;
    }
    sm_map(&header, 1), sm_str(&header, "Columns"), sm_array(&header, 1), sm_map(&header, 3);
    sm_str(&header, "name"), sm_str(&header, "ao");
    sm_str(&header, "components"), sm_u64(&header, 1);
    sm_str(&header, "element"), sm_str(&header, "f32");
    values.ptr = (const uint8_t *)ao;
    values.len = cloud->len * sizeof *ao;
    if (header.failed) {
        status = surfelshop_fail(sink, "out of memory");
    } else {
        surfelshop_bytes staged = {header.bytes, header.len};
        /* The host copies what is staged; where it refuses, its line is on the sink already. */
        status = job->stage(job->context, staged, &values, 1, sink);
    }
    sm_free(&header);
    free(ao);
    return status;
}

SURFELSHOP_EXPORT const surfelshop_plugin_table SURFELSHOP_PLUGIN = {
    SURFELSHOP_TABLE_HEAD,
    describe,
    create,
    destroy,
    surfelshop_no_frame,
    surfelshop_no_tile,
    run,
};
