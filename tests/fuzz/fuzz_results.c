/* results.json, and that whatever was read can be shown. */
#include "tools/results/results.h"
#include "fuzz.h"

#include <jansson.h>
#include <stdio.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *path = fuzz_file(data, size, ".json");
    json_t *root;
    struct err e = {""};
    if (!results_read(path, &root, &e)) {
        fuzz_check_line(&e, path);
        return 0;
    }
    FILE *nowhere = fopen("/dev/null", "w");
    fuzz_require(nowhere != NULL, "no /dev/null");
    for (int markdown = 0; markdown < 2; markdown++)
        results_table_print(nowhere, root, markdown);
    fclose(nowhere);
    int code = results_exit_code(root);
    fuzz_require(code >= 0 && code <= 3, "an exit code that is not ours");
    json_decref(root);
    return 0;
}
