/* Camera files of the assignment; a camera that was read has to give valid rays. */
#include "renderer/scene/camera.h"
#include "fuzz.h"

#include <math.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *path = fuzz_file(data, size, ".info");
    struct camera c = {.width = 40, .height = 30};
    struct err e = {""};
    if (!camera_read_file(&c, path, &e)) {
        fuzz_check_line(&e, path);
        return 0;
    }
    ray r = camera_ray(&c, 10.5f, 20.5f, 0.3f, 0.6f);
    fuzz_require(fabsf(length(r.d) - 1) < 1e-3f, "a camera's ray has no direction");
    fuzz_require(isfinite(r.o.x) && isfinite(r.o.y) && isfinite(r.o.z),
                 "a camera's ray starts nowhere");
    return 0;
}
