/* results.json, and that whatever was read can be shown. */
#include "../../tools/results.h"
#include "fuzz.h"

#include <jansson.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *path = fuzz_file(data, size, ".json");
    json_t *root;
    char *text;
    struct err e = {""};
    if (!results_read(path, &root, &e)) {
        fuzz_check_line(&e, path);
        return 0;
    }
    for (int markdown = 0; markdown < 2; markdown++) {
        fuzz_require(results_print_table(root, markdown, &text, &e),
                     "results that cannot be shown");
        free(text);
    }
    int code = results_exit_code(root);
    fuzz_require(code >= 0 && code <= 3, "an exit code that is not ours");
    json_decref(root);
    return 0;
}
