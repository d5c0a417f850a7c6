/* What was run: programs, versions, hashes. */
#define _GNU_SOURCE
#include "engine_internal.h"

#include "reference/replicates/engine_driver.h"
#include "reference/base/json_node.h"
#include "reference/base/process.h"
#include "reference/base/utc_date.h"

#include "renderer/base/fs.h"
#include "renderer/base/sha256.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static bool find_program(const struct engine *en, const char *argv0, char *path, size_t size,
                         struct err *e)
{
    char name[PATH_SIZE];
    bool relative = argv0[0] != '/' && strchr(argv0, '/') != NULL;
    snprintf(name, sizeof name, "%s%s%s", relative ? en->here : "", relative ? "/" : "", argv0);
    return process_find_or_say(name, path, size, e);
}

bool engine_program(const struct engine *en, const char *key, char *path, size_t size,
                    struct err *e)
{
    const struct engine_value values[] = {{"here", en->here},
                                          {"scene", ""},
                                          {"out", ""},
                                          {"spp", ""},
                                          {"seed", ""},
                                          {"depth", ""},
                                          {"width", ""},
                                          {"height", ""},
                                          {"threads", ""},
                                          {"name", ""},
                                          {0}};
    char **argv;
    if (!engine_argv(en, (const char *const[]){key, NULL}, values, &argv, e))
        return false;
    bool ok = find_program(en, argv[0], path, size, e);
    free(argv);
    return ok;
}

/* The first line that is not blank of the "version" command's output, as printable ASCII; "unknown"
 * without that command. */
static bool read_version(const struct engine_job *j, char line[256], struct err *e)
{
    char program[4096];
    const struct engine_value values[] = {{"here", j->en->here}, {0}};
    char **argv = NULL;
    strcpy(line, ENGINE_VERSION_UNKNOWN);
    if (json_object_get(j->en->json, "version") == NULL)
        return true;
    const struct path log = fs_path("%s/version.log", j->dir);
    bool ok = engine_program(j->en, "version", program, sizeof program, e) &&
              engine_argv(j->en, (const char *const[]){"version", NULL}, values, &argv, e);
    if (ok) {
        argv[0] = program;
        ok = process_run(&(struct process){.argv = (const char *const *)argv,
                                           .cwd = j->dir,
                                           .log = log.s,
                                           .timeout_s = j->opt->timeout_s},
                         NULL, e);
    }
    free(argv);
    FILE *f = ok ? fopen(log.s, "r") : NULL;
    if (ok && f == NULL)
        ok = err_set(e, "%s: cannot read: %s", log.s, strerror(errno));
    bool found = false;
    while (ok && !found && fgets(line, 256, f) != NULL) {
        line[strcspn(line, "\r\n")] = '\0';
        found = line[strspn(line, " \t")] != '\0';
    }
    if (f != NULL)
        fclose(f);
    for (char *c = line; *c != '\0'; c++)
        *c = *c >= ' ' && *c <= '~' ? *c : '?';
    return ok && (found || err_set(e, "%s: no version in what it prints", program));
}

/* Hashes of the files of {here} that the command names: for a script, the program's hash is only
 * that of its interpreter. */
static bool hash_files(const struct engine *en, json_t *files, struct err *e)
{
    const json_t *command = json_object_get(en->json, "command");
    for (size_t i = 0; i < json_array_size(command); i++) {
        const char *arg = json_string_value(json_array_get(command, i));
        char hash[65];
        if (strncmp(arg, "{here}/", 7) != 0 || strchr(arg + 7, '{') != NULL)
            continue;
        const struct path path = fs_path("%s/%s", en->here, arg + 7);
        if (access(path.s, F_OK) != 0)
            continue;
        if (!sha256_file(path.s, hash, e))
            return false;
        json_object_set_new(files, arg, json_string(hash));
    }
    return true;
}

static json_t *seeds_of(const struct engine_job *j)
{
    json_t *seeds = json_array();
    const bool has_seeds = j->en->output == OUTPUT_MEAN || j->en->output == OUTPUT_MOMENTS;
    const int num = (j->en->separate ? 3 : 1) * j->replicates;
    for (int k = 0; has_seeds && k < num; k++)
        json_array_append_new(seeds, json_integer(replicate_seed(j->opt->seed, k)));
    return seeds;
}

bool engine_describe(const struct engine_job *j, const struct moments *m, double wall_s,
                     json_t **manifest, struct err *e)
{
    char version[256], binary[65], description[65];
    json_t *files = json_object();
    char *command = json_command_line(NULL, json_object_get(j->en->json, "command"));
    bool ok = (command != NULL || err_set(e, "out of memory")) && read_version(j, version, e) &&
              sha256_file(j->program, binary, e) && sha256_file(j->en->file, description, e) &&
              hash_files(j->en, files, e);
    *manifest =
        !ok ? NULL
            : json_pack("{ss,ss,ss,ss,ss,sf,si,si,si,si,si,sf,sf,ss,ss,ss,ss,sO,s{sO,sb},so}",
                        "scene", j->suite->name, "scene_sha256", j->suite->sha256, "engine",
                        j->en->name, "date", utc_date_now().s, "unit", m->unit, "spp_of_unit",
                        m->spp, "width", m->width, "height", m->height, "depth", j->suite->depth,
                        "replicates", j->replicates, "spp", j->spp, "cpu_s", j->cpu_s, "wall_s",
                        wall_s, "version", version, "binary_sha256", binary, "description_sha256",
                        description, "command", command, "files", files, "settings", "description",
                        j->en->json, "half_floats", j->half, "seeds", seeds_of(j));
    json_decref(files);
    free(command);
    json_object_update(*manifest, j->independence);
    if (json_array_size(j->images) > 0)
        json_object_set(*manifest, "images_sha256", j->images);
    if (j->blocks != NULL)
        json_object_set(*manifest, "blocks", j->blocks);
    return ok;
}
