/* The .json of a scene of the suite, of both kinds: to be equal, and to differ (9x). */
#include "reference/suite/suite_json.h"
#include "fuzz.h"

#include <jansson.h>

static void read_as(const char *name, const char *file, const uint8_t *data, size_t size)
{
    struct suite_scene s = {0};
    struct err e = {""};
    snprintf(s.name, sizeof s.name, "%s", name);
    s.json = json_loadb((const char *)data, size, JSON_REJECT_DUPLICATES, NULL);
    if (s.json != NULL && !suite_json_read(file, &s, &e))
        fuzz_check_line(&e, file);
    json_decref(s.json);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    read_as("10_fuzz", "10_fuzz.json", data, size);
    read_as("90_fuzz", "90_fuzz.json", data, size);
    return 0;
}
