/* Descriptions of other renderers (tools/docs/formats/engine.md). */
#include "reference/external/engine_description.h"
#include "fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *path = fuzz_file(data, size, ".json");
    struct engine en;
    struct err e = {""};
    if (!engine_load(path, &en, &e))
        fuzz_check_line(&e, path);
    else
        engine_free(&en);
    return 0;
}
