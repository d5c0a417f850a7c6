#include "png_metadata.h"

#include "renderer/base/cli_rewrite.h"
#include "renderer/base/shell_quote.h"
#include "renderer/base/version.h"

#include <stdio.h>
#include <stdlib.h>

const char *const png_metadata_kind_names[] = {"image", "rates", "heatmap", NULL};

/* No option says in two ways what the samples and the kind of picture say already. */
static const struct option_words said_apart[] = {{"-s", 1}, {"--spp", 1}, {"--aov", 0}, {0}};

static char *canonical_command(const struct output *o, enum picture_kind kind)
{
    char program[] = "pathtracer", most[] = "-s", spp[16],
         **apart = options_apart(o->argc, o->argv);
    int num = 0, n = 1;
    while (apart != NULL && apart[num] != NULL)
        num++;
    char **word = calloc((size_t)num + 4, sizeof *word), *command = NULL;
    if (apart != NULL && word != NULL) {
        word[0] = program;
        if (o->opt->pilot_tolerance >= 0 && kind != PICTURE_HEATMAP) {
            snprintf(spp, sizeof spp, "%d", o->opt->spp);
            word[n++] = most;
            word[n++] = spp;
        }
        int kept = cli_rewrite_kept(cli_rewrite_render, num - 1, apart + 1, word + n);
        word[n + cli_rewrite_kept(said_apart, kept, word + n, word + n)] = NULL;
        command = shell_quote_join(NULL, (const char *const *)word);
    }
    free(apart);
    free(word);
    return command;
}

static void validate_log(struct png_metadata *t, const char *name, const char *value)
{
    t->attr[t->num++] = (struct image_attr){name, value};
}

bool png_metadata_make(const struct output *o, enum picture_kind kind, uint32_t num_samples,
                       struct png_metadata *t)
{
    *t = (struct png_metadata){.command = canonical_command(o, kind)};
    if (t->command == NULL)
        return false;
    validate_log(t, "assay:version", assay_version);
    validate_log(t, "assay:picture", png_metadata_kind_names[kind]);
    validate_log(t, "assay:command", t->command);
    validate_log(t, "assay:scene", o->id->scene);
    validate_log(t, "assay:settings", o->id->settings);
    validate_log(t, "assay:cell", o->id->cell);
    if (kind == PICTURE_HEATMAP)
        return true;
    snprintf(t->samples, sizeof t->samples, "%d:%lld", o->opt->first,
             (long long)o->opt->first + num_samples);
    validate_log(t, "assay:adaptive", o->id->adaptive);
    validate_log(t, "assay:seed", o->id->seed);
    validate_log(t, "assay:samples", t->samples);
    if (kind == PICTURE_RATES) {
        snprintf(t->most, sizeof t->most, "%d", o->opt->last - o->opt->first);
        validate_log(t, "assay:most", t->most);
    } else if (o->ranges != NULL) {
        validate_log(t, "assay:ranges", o->ranges);
    }
    return true;
}

void png_metadata_free(struct png_metadata *t)
{
    free(t->command);
    *t = (struct png_metadata){0};
}
