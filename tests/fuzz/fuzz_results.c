/* results.json: what is accepted can be printed, and a command that can be split can be joined and
 * split again. */
#include "renderer/base/shell_quote.h"
#include "tools/results/results_table.h"
#include "fuzz.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void check_command(const char *command)
{
    struct err e = {""};
    int num = 0, again = 0;
    char **word = shell_quote_split(command, &num, &e);
    if (word == NULL) {
        fuzz_check_line(&e, NULL);
        return;
    }
    char *text = shell_quote_join(NULL, (const char *const *)word);
    fuzz_require(text != NULL, "no memory");
    char **back = shell_quote_split(text, &again, &e);
    fuzz_require(back != NULL && again == num, "words that are not read back");
    for (int i = 0; i < num; i++)
        fuzz_require(strcmp(word[i], back[i]) == 0, "another word than was written");
    free(back);
    free(text);
    free(word);
}

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
    check_command(member_text(root, "command"));
    json_decref(root);
    return 0;
}
