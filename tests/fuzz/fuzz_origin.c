/* What exported scenes and pages say of how they were made, and that a command that can be read can be written and read again. */
#include "reference/base/export_provenance.h"
#include "renderer/base/shell_quote.h"
#include "tools/reproduce/reproduce_page.h"
#include "fuzz.h"

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
    char *ascii = shell_quote_ascii(text);
    fuzz_require(ascii != NULL, "no memory");
    for (const char *c = ascii; *c != '\0'; c++)
        fuzz_require(*c >= ' ' && *c <= '~', "a byte that is not printable ASCII");
    char **back = shell_quote_split(ascii, &again, &e);
    fuzz_require(back != NULL && again == num, "words that are not read back");
    for (int i = 0; i < num; i++)
        fuzz_require(strcmp(word[i], back[i]) == 0, "another word than was written");
    free(back);
    free(ascii);
    free(text);
    free(word);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *path = fuzz_file(data, size, ".pov");
    struct export_said said;
    struct err e = {""};
    if (!export_origin_read(path, &said, &e))
        fuzz_check_line(&e, path);
    if (said.command != NULL)
        check_command(said.command);
    export_said_free(&said);
    json_t *page = reproduce_page_origin(path, &e);
    if (page == NULL)
        fuzz_check_line(&e, path);
    else
        check_command(json_string_value(json_object_get(page, "command")));
    json_decref(page);
    return 0;
}
