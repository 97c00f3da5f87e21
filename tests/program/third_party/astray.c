/* The renderer rim.c, which does to its process what FAULT names, at its first frame. */
#define _DEFAULT_SOURCE

#define SURFELSHOP_PLUGIN rim_table
#include "rim.c"
#undef SURFELSHOP_PLUGIN

#include <fenv.h>
#include <locale.h>
#include <stdlib.h>
#include <unistd.h>

#define SEGFAULT 1
#define ABORT 2
#define CLOSE 3
#define EXIT 4
#define ENDLESS 5
#define MODES 6
#define FORK 7
/* Where the process that is left is named. */
#ifndef LEFT
#define LEFT ""
#endif

static int32_t astray(void *instance, surfelshop_bytes request, surfelshop_sink sink)
{
    if (FAULT == SEGFAULT) {
        volatile int *volatile nowhere = NULL;
        *nowhere = 1;
    }
    if (FAULT == ABORT)
        abort();
    if (FAULT == CLOSE)
        for (int descriptor = 0; descriptor < 4096; descriptor++)
            close(descriptor);
    if (FAULT == EXIT)
        exit(3);
    for (volatile int goes_on = FAULT == ENDLESS; goes_on;)
        ;
    if (FAULT == MODES) {
        fesetround(FE_UPWARD);
        setlocale(LC_ALL, "");
        printf("a line that is no result\n");
        fflush(stdout);
        if (chdir("/") != 0)
            return surfelshop_fail(sink, "the folder cannot be left");
    }
    pid_t left = FAULT == FORK ? fork() : -1;
    if (left > 0) {
        FILE *file = fopen(LEFT, "w");
        if (file == NULL || fprintf(file, "%d", (int)left) < 0 || fclose(file) != 0)
            return surfelshop_fail(sink, "the process that is left cannot be named");
    }
    if (left == 0) {
        /* Nobody waits for what it holds open, and it ends by itself some time. */
        for (int descriptor = 0; descriptor < 4096; descriptor++)
            close(descriptor);
        sleep(60);
        _exit(1);
    }
    return frame(instance, request, sink);
}

SURFELSHOP_EXPORT const surfelshop_plugin_table SURFELSHOP_PLUGIN = {
    SURFELSHOP_TABLE_HEAD, describe, create, destroy, astray, surfelshop_no_tile, surfelshop_no_run,
};
