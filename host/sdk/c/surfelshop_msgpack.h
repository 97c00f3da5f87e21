/*
 * surfelshop_msgpack.h: builds and reads the messages of Surfelshop's plugin boundary, which are
 * MessagePack. Plain C99, compiles as C++, needs no other file.
 *
 * Building is flat: a map or an array is announced with its number of entries, and then its entries
 * are written one after the other, in maps each key before its value. Numbers take the smallest
 * form, as Rust's rmp-serde writes them, so that equal messages have equal bytes.
 *
 * Reading works on the bytes where they are, which must stay unchanged. It takes any bytes: it
 * never reads behind their end, and nothing recurses, so no depth of nesting exhausts the stack.
 * What is not there or damaged is a value that has no kind; all functions take it and answer with
 * nothing, so a path through a message needs one check at its end.
 *
 * Licence: MIT OR Apache-2.0.
 */
#ifndef SURFELSHOP_MSGPACK_H
#define SURFELSHOP_MSGPACK_H

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/** A message being built; `failed` is 1 where memory ran out, and then the bytes are of no use. */
typedef struct sm_builder {
    uint8_t *bytes;
    size_t len, room;
    int failed;
} sm_builder;

/** An empty message. */
static inline sm_builder sm_start(void)
{
    sm_builder empty = {NULL, 0, 0, 0};
    return empty;
}

/** Frees a message, also one that failed. */
static inline void sm_free(sm_builder *b)
{
    free(b->bytes);
    *b = sm_start();
}

/** Appends bytes as they are. */
static inline void sm_raw(sm_builder *b, const void *from, size_t len)
{
    if (b->failed || len == 0)
        return;
    if (len > b->room - b->len) {
        size_t room = b->room > 0 ? b->room : 256;
        while (len > room - b->len && room <= SIZE_MAX / 2)
            room *= 2;
        uint8_t *bytes = len > room - b->len ? NULL : (uint8_t *)realloc(b->bytes, room);
        if (bytes == NULL) {
            b->failed = 1;
            return;
        }
        b->bytes = bytes, b->room = room;
    }
    memcpy(b->bytes + b->len, from, len);
    b->len += len;
}

/** Appends a marker and the last `width` bytes of a number, most significant first. */
static inline void sm_marked(sm_builder *b, unsigned marker, uint64_t number, unsigned width)
{
    uint8_t bytes[9] = {(uint8_t)marker};
    for (unsigned i = 0; i < width; i++)
        bytes[1 + i] = (uint8_t)(number >> 8 * (width - 1 - i));
    sm_raw(b, bytes, 1 + width);
}

/**
 * Appends a number below `few` in one byte with `fixed`, and others behind a marker: `marker` where
 * `width` bytes do, the next one for twice as many, and so on.
 */
static inline void sm_sized(sm_builder *b, uint64_t number, unsigned few, unsigned fixed,
                            unsigned marker, unsigned width)
{
    if (number < few) {
        sm_marked(b, fixed + (unsigned)number, 0, 0);
        return;
    }
    for (; width < 8 && number >> 8 * width != 0; width *= 2)
        marker++;
    sm_marked(b, marker, number, width);
}

static inline void sm_nil(sm_builder *b) { sm_marked(b, 0xc0, 0, 0); }
static inline void sm_bool(sm_builder *b, int yes) { sm_marked(b, yes ? 0xc3 : 0xc2, 0, 0); }
static inline void sm_u64(sm_builder *b, uint64_t n) { sm_sized(b, n, 128, 0, 0xcc, 1); }
/** Announces an array; as many values follow. */
static inline void sm_array(sm_builder *b, uint32_t n) { sm_sized(b, n, 16, 0x90, 0xdc, 2); }
/** Announces a map; as many keys follow, each with its value behind it. */
static inline void sm_map(sm_builder *b, uint32_t n) { sm_sized(b, n, 16, 0x80, 0xde, 2); }

static inline void sm_i64(sm_builder *b, int64_t n)
{
    unsigned doublings = (unsigned)((n < INT8_MIN) + (n < INT16_MIN) + (n < INT32_MIN));
    if (n >= 0)
        sm_u64(b, (uint64_t)n);
    else if (n >= -32)
        sm_marked(b, (unsigned)(256 + n), 0, 0);
    else
        sm_marked(b, 0xd0 + doublings, (uint64_t)n, 1u << doublings);
}

static inline void sm_f32(sm_builder *b, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    sm_marked(b, 0xca, bits, 4);
}

static inline void sm_f64(sm_builder *b, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    sm_marked(b, 0xcb, bits, 8);
}

/** Appends a key or a text: UTF-8 that ends with a zero and is shorter than 2^32 bytes. */
static inline void sm_str(sm_builder *b, const char *text)
{
    size_t len = strlen(text);
    b->failed |= len > UINT32_MAX;
    sm_sized(b, len, 32, 0xa0, 0xd9, 1);
    sm_raw(b, text, len);
}

/** What a value is; letters, so that a table of them can be read. */
enum {
    SM_NOTHING = '-', SM_NIL = 'n', SM_BOOL = 'b', SM_UINT = 'u', SM_INT = 'i', SM_FLOAT = 'f',
    SM_STR = 's', SM_BIN = 'x', SM_EXT = 'e', SM_ARRAY = 'a', SM_MAP = 'm'
};

/** A value to be read: it begins at `at`, and the message ends before `end`. */
typedef struct sm_value {
    const uint8_t *at, *end;
} sm_value;

/**
 * What the first bytes of a value say, and where those behind them are. `number` is a whole number
 * (an SM_INT in two's complement), how many entries a map or an array has, or how many bytes, all
 * of which are there, an SM_STR, SM_BIN or SM_EXT has; `real` is an SM_FLOAT.
 */
typedef struct sm_head {
    int kind;
    uint64_t number;
    double real;
    const uint8_t *body;
} sm_head;

/** The first value of a message; of no bytes, and of NULL, nothing. */
static inline sm_value sm_open(const void *bytes, size_t len)
{
    sm_value v = {(const uint8_t *)bytes, (const uint8_t *)bytes};
    if (bytes != NULL)
        v.end += len;
    return v;
}

/** Reads the first bytes of a value. */
static inline sm_head sm_read(sm_value v)
{
    /* The markers from 0xc0 to 0xdf: what each announces, and in how many bytes its number is. */
    static const char *const kinds = "n-bbxxxeeeffuuuuiiiieeeeesssaamm";
    static const char *const widths = "00001241244812481248000001242424";
    const sm_head nothing = {SM_NOTHING, 0, 0.0, NULL};
    sm_head h = nothing;
    if (v.at == v.end)
        return nothing;
    unsigned marker = *v.at, width = 0;
    h.body = v.at + 1;
    if (marker < 0x80)
        h.kind = SM_UINT, h.number = marker;
    else if (marker < 0xa0)
        h.kind = marker < 0x90 ? SM_MAP : SM_ARRAY, h.number = marker & 15;
    else if (marker < 0xc0)
        h.kind = SM_STR, h.number = marker & 31;
    else if (marker < 0xe0)
        h.kind = kinds[marker - 0xc0], width = (unsigned)(widths[marker - 0xc0] - '0');
    else
        h.kind = SM_INT, h.number = ~(uint64_t)255 | marker;
    if ((size_t)(v.end - h.body) < width)
        return nothing;
    for (unsigned i = 0; i < width; i++)
        h.number = h.number << 8 | *h.body++;
    if (h.kind == SM_BOOL) {
        h.number = marker & 1;
    } else if (h.kind == SM_INT && width > 0 && width < 8 && h.number >> (8 * width - 1) != 0) {
        h.number |= ~(uint64_t)0 << 8 * width;
    } else if (h.kind == SM_FLOAT && width == 8) {
        memcpy(&h.real, &h.number, sizeof h.real);
    } else if (h.kind == SM_FLOAT) {
        uint32_t bits = (uint32_t)h.number;
        float value;
        memcpy(&value, &bits, sizeof value);
        h.real = value;
    } else if (h.kind == SM_EXT) {
        /* Its size does not count the byte that says of which type it is. */
        h.number = (width > 0 ? h.number : (uint64_t)1 << (marker - 0xd4)) + 1;
    }
    int has_bytes = h.kind == SM_STR || h.kind == SM_BIN || h.kind == SM_EXT;
    return has_bytes && h.number > (uint64_t)(v.end - h.body) ? nothing : h;
}

/** What follows a whole value: at the end of the message `at` is `end`, behind damage NULL. */
static inline sm_value sm_after(sm_value v)
{
    for (uint64_t left = 1; left > 0; left--) {
        sm_head h = sm_read(v);
        v.at = h.body;
        if (h.kind == SM_STR || h.kind == SM_BIN || h.kind == SM_EXT)
            v.at += h.number;
        else if (h.kind == SM_ARRAY || h.kind == SM_MAP)
            left += h.kind == SM_MAP ? 2 * h.number : h.number;
        /* Each value has a byte at least, so a number of entries that cannot be is seen at once. */
        if (h.kind == SM_NOTHING || left - 1 > (uint64_t)(v.end - v.at))
            return sm_open(NULL, 0);
    }
    return v;
}

/** How many entries a map or an array has; 0 for other values. */
static inline uint64_t sm_count(sm_value v)
{
    sm_head h = sm_read(v);
    return h.kind == SM_ARRAY || h.kind == SM_MAP ? h.number : 0;
}

/** The value at a position of an array; sm_after leads from one to the next. */
static inline sm_value sm_item(sm_value array, uint64_t index)
{
    sm_head h = sm_read(array);
    if (h.kind != SM_ARRAY || index >= h.number)
        return sm_open(NULL, 0);
    for (array.at = h.body; index > 0 && array.at != array.end; index--)
        array = sm_after(array);
    return array;
}

/** The bytes of a string, which no zero ends, and how many they are; NULL for other values. */
static inline const char *sm_text(sm_value v, size_t *len)
{
    sm_head h = sm_read(v);
    *len = h.kind == SM_STR ? (size_t)h.number : 0;
    return h.kind == SM_STR ? (const char *)h.body : NULL;
}

/** Whether a value is this string. */
static inline int sm_is(sm_value v, const char *text)
{
    size_t len;
    const char *found = sm_text(v, &len);
    return found != NULL && len == strlen(text) && memcmp(found, text, len) == 0;
}

/** The value of a key in a map; of the first where there are several. */
static inline sm_value sm_find(sm_value map, const char *key)
{
    sm_head h = sm_read(map);
    uint64_t left = h.kind == SM_MAP ? h.number : 0;
    for (map.at = h.body; left > 0 && map.at != NULL; left--) {
        sm_value value = sm_after(map);
        if (sm_is(map, key))
            return value;
        map = sm_after(value);
    }
    return sm_open(NULL, 0);
}

/** Puts a number of any form, or 0 or 1 for a boolean, into `out` and returns 1; else returns 0. */
static inline int sm_number(sm_value v, double *out)
{
    sm_head h = sm_read(v);
    if (h.kind == SM_FLOAT)
        *out = h.real;
    else if (h.kind == SM_INT && h.number >> 63 != 0)
        *out = -(double)(0 - h.number);
    else if (h.kind == SM_INT || h.kind == SM_UINT || h.kind == SM_BOOL)
        *out = (double)h.number;
    else
        return 0;
    return 1;
}

#endif
