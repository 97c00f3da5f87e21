/*
 * rim.c: a renderer for Surfelshop in C, Lambert's law with a coloured rim.
 *
 *     cc -shared -fPIC -O2 -o librim_c.so rim.c
 *
 * It is the twin of the shading template of `surfelshop plugins new`, which is written in Rust: both write
 * the same bytes for the same frame. It computes no pixel itself. It hands the host a shader, says
 * which texture that fills, and gives the values of its parameters.
 *
 *     parameter   type    default                meaning
 *     rim         colour  0.2,0.4,1 (linear)     radiance of the rim
 *     sharpness   float   3, from 0.5 to 16      how narrow the rim is
 *
 * Licence: MIT OR Apache-2.0.
 */
#include "surfelshop.h"
#include "surfelshop_msgpack.h"

#include <float.h>
#include <math.h>
#include <stdio.h>

SURFELSHOP_MANIFEST_OF(
    "id\torg.example.rim-c\n"
    "version\t0.1.0\n"
    "authors\t\n"
    "license\tMIT OR Apache-2.0\n"
    "renderer\trim-c\tRim light in C\tLambert's law with a coloured rim.\n");

/* One unit is in the manifest, so it is number 0. */
#define RIM 0

/* Each declaration and the reading of its value use the same numbers. */
static const float RIM_DEFAULT[3] = {0.2f, 0.4f, 1.0f};
#define SHARPNESS_DEFAULT 3.0
#define SHARPNESS_LOW 0.5
#define SHARPNESS_HIGH 16.0

/* The host calls `shade` for each pixel that the surface covers. */
static const char SHADER[] =
    "#import surfelshop::surface::Surface\n"
    "#import surfelshop::light\n"
    "#import params::settings\n"
    "\n"
    "// Linear radiance of a covered pixel, before exposure and tone mapping.\n"
    "fn shade(s: Surface) -> vec4<f32> {\n"
    "    let arriving = light::diffuse_irradiance_at(s.position, s.normal);\n"
    "    let turned_away = 1.0 - clamp(dot(s.normal, s.to_eye), 0.0, 1.0);\n"
    "    return vec4(s.albedo * arriving + settings.rim * pow(turned_away, settings.sharpness), 1.0);\n"
    "}\n";

/* The module `params`, which declares the parameters for all shaders of a plugin. */
static const char PARAMS[] =
    "#define_import_path params\n"
    "struct Settings {\n"
    "    rim: vec3<f32>,\n"
    "    sharpness: f32,\n"
    "}\n"
    "var<uniform> settings: Settings;\n";

/** The values of the parameters. */
typedef struct settings {
    float rim[3];
    float sharpness;
} settings;

/* The size of that structure in WGSL. */
#define UNIFORM_LEN 16

/** Writes what of a declaration comes before its default. */
static void begin_parameter(sm_builder *b, const char *id, const char *kind)
{
    sm_map(b, 8);
    sm_str(b, "id"), sm_str(b, id);
    sm_str(b, "kind"), sm_str(b, kind);
    sm_str(b, "default"), sm_map(b, 1), sm_str(b, kind);
}

/** Writes what of a declaration comes behind its range. */
static void end_parameter(sm_builder *b, const char *doc, int logarithmic)
{
    sm_str(b, "unit"), sm_str(b, "");
    sm_str(b, "doc"), sm_str(b, doc);
    sm_str(b, "quality"), sm_bool(b, 0);
    sm_str(b, "logarithmic"), sm_bool(b, logarithmic);
}

static void put_color(sm_builder *b, const float color[3])
{
    sm_array(b, 3);
    for (int i = 0; i < 3; i++)
        sm_f32(b, color[i]);
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

static int32_t no_such_unit(uint32_t unit, surfelshop_sink sink)
{
    char line[80];
    snprintf(line, sizeof line, "unit %lu was asked for, the plugin has 1", (unsigned long)unit);
    return surfelshop_fail(sink, line);
}

static int32_t describe(uint32_t unit, surfelshop_sink sink)
{
    sm_builder b = sm_start();
    if (unit != RIM)
        return no_such_unit(unit, sink);
    sm_map(&b, 2);
    sm_str(&b, "params"), sm_array(&b, 2);

    begin_parameter(&b, "rim", "Color");
    put_color(&b, RIM_DEFAULT);
    sm_str(&b, "range"), sm_nil(&b);
    end_parameter(&b, "Radiance of the rim.", 0);

    begin_parameter(&b, "sharpness", "Float");
    sm_f64(&b, SHARPNESS_DEFAULT);
    sm_str(&b, "range"), sm_array(&b, 2), sm_f64(&b, SHARPNESS_LOW), sm_f64(&b, SHARPNESS_HIGH);
    end_parameter(&b, "How narrow the rim is.", 1);

    sm_str(&b, "limits"), sm_array(&b, 0);
    return deliver(&b, SURFELSHOP_CHANNEL_DESCRIPTION, sink);
}

static int32_t create(uint32_t unit, surfelshop_bytes host, void **out, surfelshop_sink sink)
{
    /* A frame depends on its request alone, so this, which holds nothing, is every instance. */
    static char stateless;
    (void)host;
    if (unit != RIM)
        return no_such_unit(unit, sink);
    *out = &stateless;
    return SURFELSHOP_OK;
}

static int32_t destroy(void *instance, surfelshop_sink sink)
{
    (void)instance, (void)sink;
    return SURFELSHOP_OK;
}

/** The colour that was set, or the default where one of its numbers is missing or none. */
static void read_rim(sm_value values, float rim[3])
{
    sm_value color = sm_find(sm_find(values, "rim"), "Color");
    int good = sm_count(color) == 3;
    for (int i = 0; i < 3 && good; i++) {
        double number = NAN;
        sm_number(sm_item(color, (uint64_t)i), &number);
        good = number >= -FLT_MAX && number <= FLT_MAX;
        rim[i] = good ? (float)number : 0.0f;
    }
    if (!good)
        memcpy(rim, RIM_DEFAULT, sizeof RIM_DEFAULT);
}

/** The number that was set, brought into its range, or the default where none was. */
static float read_sharpness(sm_value values)
{
    sm_value value = sm_find(values, "sharpness");
    double number = NAN;
    /* Whole numbers may come as such. */
    if (!sm_number(sm_find(value, "Float"), &number))
        sm_number(sm_find(value, "Int"), &number);
    if (!isfinite(number))
        number = SHARPNESS_DEFAULT;
    if (number < SHARPNESS_LOW)
        number = SHARPNESS_LOW;
    if (number > SHARPNESS_HIGH)
        number = SHARPNESS_HIGH;
    return (float)number;
}

/** Writes the settings behind one another, little-endian. */
static void put_uniform(const settings *s, uint8_t bytes[UNIFORM_LEN])
{
    const float members[4] = {s->rim[0], s->rim[1], s->rim[2], s->sharpness};
    for (int i = 0; i < 4; i++) {
        uint32_t bits;
        memcpy(&bits, &members[i], sizeof bits);
        for (int k = 0; k < 4; k++)
            bytes[4 * i + k] = (uint8_t)(bits >> 8 * k);
    }
}

/**
 * Writes the graph: one texture, filled by one pass, shown as the picture. Each line has a field's
 * name and its value. The host knows defaults for many of these fields; they are all here so that
 * the bytes are those of the Rust twin.
 */
static void put_structure(sm_builder *b)
{
    sm_map(b, 8);
    sm_str(b, "textures"), sm_array(b, 1), sm_map(b, 6);
    sm_str(b, "label"), sm_str(b, "color");
    sm_str(b, "format"), sm_str(b, "rgba32float");
    sm_str(b, "extent"), sm_map(b, 1), sm_str(b, "View");
    sm_map(b, 1), sm_str(b, "divisor"), sm_u64(b, 1);
    sm_str(b, "volume"), sm_bool(b, 0);
    sm_str(b, "mips"), sm_u64(b, 1);
    sm_str(b, "lifetime"), sm_str(b, "Frame");

    sm_str(b, "buffers"), sm_array(b, 0);

    sm_str(b, "uniforms"), sm_array(b, 1), sm_map(b, 2);
    sm_str(b, "offset"), sm_u64(b, 0);
    sm_str(b, "len"), sm_u64(b, UNIFORM_LEN);

    sm_str(b, "passes"), sm_array(b, 1), sm_map(b, 10);
    sm_str(b, "name"), sm_str(b, "shade");
    sm_str(b, "work"), sm_map(b, 1), sm_str(b, "Shading"), sm_map(b, 4);
    sm_str(b, "surface"), sm_str(b, "blended");
    sm_str(b, "target"), sm_u64(b, 0);
    sm_str(b, "elsewhere"), sm_nil(b);
    sm_str(b, "per_surfel"), sm_bool(b, 0);
    sm_str(b, "wgsl"), sm_str(b, SHADER);
    sm_str(b, "modules"), sm_array(b, 1), sm_map(b, 3);
    sm_str(b, "path"), sm_str(b, "params");
    sm_str(b, "file"), sm_str(b, "settings `params`");
    sm_str(b, "wgsl"), sm_str(b, PARAMS);
    sm_str(b, "entry"), sm_str(b, "shade");
    sm_str(b, "constants"), sm_map(b, 0);
    sm_str(b, "bindings"), sm_map(b, 1);
    sm_str(b, "params::settings"), sm_map(b, 1), sm_str(b, "Uniform"), sm_u64(b, 0);
    sm_str(b, "merges"), sm_bool(b, 1);
    sm_str(b, "features"), sm_map(b, 0);
    sm_str(b, "camera"), sm_nil(b);

    sm_str(b, "outputs"), sm_array(b, 1);
    sm_array(b, 2), sm_str(b, "color"), sm_u64(b, 0);
    sm_str(b, "wants_another_frame"), sm_bool(b, 0);
    sm_str(b, "cameras"), sm_array(b, 0);

    /* The host finds each member by its name in the shader's structure and lays them out. */
    sm_str(b, "members"), sm_map(b, 1), sm_u64(b, 0), sm_array(b, 2);
    sm_map(b, 2), sm_str(b, "name"), sm_str(b, "rim"), sm_str(b, "kind"), sm_str(b, "vec3");
    sm_map(b, 2), sm_str(b, "name"), sm_str(b, "sharpness"), sm_str(b, "kind"), sm_str(b, "f32");
}

static int32_t frame(void *instance, surfelshop_bytes request, surfelshop_sink sink)
{
    sm_value values = sm_find(sm_open(request.ptr, request.len), "values");
    sm_builder structure = sm_start();
    settings s;
    uint8_t data[UNIFORM_LEN];
    (void)instance;
    if (sm_read(values).kind != SM_MAP)
        return surfelshop_fail(sink, "expected a frame's request with a map `values`, found none");
    read_rim(values, s.rim);
    s.sharpness = read_sharpness(values);
    put_uniform(&s, data);
    surfelshop_write(sink, SURFELSHOP_CHANNEL_DATA, data, sizeof data);
    put_structure(&structure);
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
