/* The tool of darken.c that is led by hand, misbehaving in one way, which FAULT names. */
#include "surfelshop.h"

#define PANICS 1
#define HANGS 2
#define OTHERS 3

#define run honest_run
#define SURFELSHOP_PLUGIN honest_plugin
#include "darken.c"
#undef run
#undef SURFELSHOP_PLUGIN

static int32_t run(void *instance, surfelshop_bytes call, const surfelshop_cloud *cloud,
                   const surfelshop_job *job, surfelshop_sink sink)
{
    if (FAULT == PANICS) {
        honest_run(instance, call, cloud, job, sink);
        surfelshop_fail(sink, "at the worst moment");
        return SURFELSHOP_PANIC;
    }
    if (FAULT == HANGS)
        for (volatile int forever = 1; forever;)
            ;
    {
        /* A value of a surfel that it did not get. */
        const uint32_t surfel = (uint32_t)cloud->len;
        const float value = 0.5f;
        surfelshop_bytes values[2], staged;
        sm_builder header = sm_start();
        int32_t status;
        sm_map(&header, 1), sm_str(&header, "Values"), sm_array(&header, 1), sm_map(&header, 3);
        sm_str(&header, "name"), sm_str(&header, "ao");
        sm_str(&header, "components"), sm_u64(&header, 1);
        sm_str(&header, "element"), sm_str(&header, "f32");
        values[0].ptr = (const uint8_t *)&surfel, values[0].len = sizeof surfel;
        values[1].ptr = (const uint8_t *)&value, values[1].len = sizeof value;
        staged.ptr = header.bytes, staged.len = header.len;
        status = job->stage(job->context, staged, values, 2, sink);
        sm_free(&header);
        return status;
    }
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
