/* The .json of a scene of the suite, of both kinds: to be equal, and to differ (9x). And the suite.json of a user's own. */
#include "reference/suite/suite_json.h"
#include "reference/suite/suite_own.h"
#include "fuzz.h"

#include <jansson.h>

#include <stdio.h>

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

static void read_own(const uint8_t *data, size_t size)
{
    const char *dir = fuzz_dir(fuzz_file(data, size, ".json"), "suite.json");
    struct suite out = {0};
    struct err e = {""};
    if (!suite_own_read(dir, &out, &e))
        fuzz_check_line(&e, dir);
    suite_free(&out);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    read_as("10_fuzz", "10_fuzz.json", data, size);
    read_as("90_fuzz", "90_fuzz.json", data, size);
    read_own(data, size);
    return 0;
}
