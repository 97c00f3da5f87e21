/* A plugin that breaks the boundary in one way, which FAULT names. What no Rust author could do by
 * accident is easy in C. */
#include "surfelshop.h"

#include <stdlib.h>
#include <time.h>

#define NO_UNITS 1
#define TWO_OF_A_NAME 2
#define TWO_KINDS 3
#define GIGABYTE 4
#define NESTED 5
#define NOTHING 6
#define STATUS 7
#define NO_INSTANCE 8
#define ENDLESS 9
#define SEGFAULT 10
#define LONG_ERROR 11
#define COUNT 12
#define NO_FUNCTION 13

#if FAULT == NO_UNITS
#define UNITS ""
#elif FAULT == TWO_OF_A_NAME
#define UNITS "renderer\thostile\tOne\tThe first.\nrenderer\thostile\tTwo\tThe second.\n"
#elif FAULT == TWO_KINDS
#define UNITS "renderer\thostile\tOne\tThe first.\ntool\thostile\tTwo\tThe second.\n"
#else
#define UNITS "renderer\thostile\tHostile\tMeans harm.\n"
#endif

SURFELSHOP_MANIFEST_OF("id\torg.surfelshop.test.hostile\nversion\t0.1.0\n" UNITS);

static int32_t describe(uint32_t unit, surfelshop_sink sink)
{
    static const uint8_t nothing[] = {0x80};
    (void)unit;
    surfelshop_write(sink, SURFELSHOP_CHANNEL_DESCRIPTION, nothing, sizeof nothing);
    return SURFELSHOP_OK;
}

static int32_t create(uint32_t unit, surfelshop_bytes host, void **out, surfelshop_sink sink)
{
    static char instance;
    (void)unit, (void)host, (void)sink;
    if (FAULT != NO_INSTANCE)
        *out = &instance;
    return SURFELSHOP_OK;
}

static int32_t destroy(void *instance, surfelshop_sink sink)
{
    (void)instance, (void)sink;
    return SURFELSHOP_OK;
}

static int32_t frame(void *instance, surfelshop_bytes request, surfelshop_sink sink)
{
    (void)instance, (void)request;
    if (FAULT == GIGABYTE) {
        size_t len = (size_t)1 << 30;
        uint8_t *bytes = calloc(len, 1);
        if (bytes == NULL)
            return surfelshop_fail(sink, "out of memory");
        surfelshop_write(sink, SURFELSHOP_CHANNEL_STRUCTURE, bytes, len);
        free(bytes);
    }
    if (FAULT == NESTED) {
        /* {"textures": [[[[[... */
        static uint8_t bytes[1 << 20] = {0x81, 0xa8, 't', 'e', 'x', 't', 'u', 'r', 'e', 's'};
        memset(bytes + 10, 0x91, sizeof bytes - 10);
        surfelshop_write(sink, SURFELSHOP_CHANNEL_STRUCTURE, bytes, sizeof bytes);
    }
    if (FAULT == COUNT) {
        /* {"textures": an array of 2^32 - 1 */
        static const uint8_t bytes[] = {0x81, 0xa8, 't', 'e', 'x', 't', 'u', 'r',
                                        'e',  's',  0xdd, 255, 255, 255, 255};
        surfelshop_write(sink, SURFELSHOP_CHANNEL_STRUCTURE, bytes, sizeof bytes);
    }
    if (FAULT == LONG_ERROR) {
        static uint8_t line[1 << 20];
        memset(line, 'x', sizeof line);
        surfelshop_write(sink, SURFELSHOP_CHANNEL_ERROR, line, sizeof line);
        return SURFELSHOP_ERROR;
    }
    if (FAULT == STATUS)
        return 77;
    // Until the host has long given it up: what goes on for ever takes a processor from the tests after it.
    for (time_t start = time(NULL); FAULT == ENDLESS && time(NULL) - start < 15;)
        ;
    if (FAULT == SEGFAULT) {
        volatile int *volatile nowhere = NULL;
        *nowhere = 1;
    }
    return SURFELSHOP_OK;
}

SURFELSHOP_EXPORT const surfelshop_plugin_table SURFELSHOP_PLUGIN = {
    SURFELSHOP_TABLE_HEAD, describe, create, destroy, frame, surfelshop_no_tile,
#if FAULT == NO_FUNCTION
    NULL,
#else
    surfelshop_no_run,
#endif
};
