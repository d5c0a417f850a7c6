/* EXR files with moments: OpenEXR's C library, and our use of it. */
#include "renderer/image/moments.h"
#include "fuzz.h"

#include <math.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *path = fuzz_file(data, size, ".exr");
    struct moments m;
    struct err e = {""};
    if (!moments_read(path, &m, NULL, &e)) {
        fuzz_check_line(&e, path);
        return 0;
    }
    for (size_t i = 0; i < 3 * (size_t)m.width * (size_t)m.height; i++)
        fuzz_require(isfinite(m.mean[i]) && m.m2[i] >= 0 && m.n[i / 3] > 0,
                     "moments that are none");
    moments_free(&m);
    return 0;
}
