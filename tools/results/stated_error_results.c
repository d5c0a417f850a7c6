#include "stated_error_results.h"

#include "reference/suite/suite.h"

#include <string.h>

/* Of a claim with an error. */
static bool only_time_missing(const json_t *c)
{
    const char *verdict = member_text(c, "verdict");
    return verdict == NULL || strcmp(verdict, verdict_name(VERDICT_INCONCLUSIVE)) == 0;
}

static bool check_one(const json_t *c, const char *where, struct err *e)
{
    static const char *const numbers[] = {"renders", "spp",   "alpha",  "margin",
                                          "pixels",  "image", "seconds"};
    bool passed = json_is_true(json_object_get(c, "passed"));
    if (member_text(c, "scene") == NULL || member_text(c, "engine") == NULL)
        return err_set(e, "%s: 'scene' or 'engine' is missing", where);
    if (member_text(c, "error") != NULL)
        return (!passed && only_time_missing(c)) ||
               err_set(e, "%s: has an 'error' and yet 'passed' or a 'verdict'", where);
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        if (!json_is_number(json_object_get(c, numbers[i])))
            return err_set(e, "%s: '%s' is not a number", where, numbers[i]);
    if (!json_is_interval(json_object_get(c, "pixels_ci")) ||
        !json_is_interval(json_object_get(c, "image_range")))
        return err_set(e, "%s: 'pixels_ci' or 'image_range' is not an interval", where);
    const json_t *noise = json_object_get(c, "noise"), *early = json_object_get(c, "too_early");
    if (noise != NULL &&
        (!json_is_number(noise) || !json_is_interval(json_object_get(c, "noise_ci"))))
        return err_set(e, "%s: 'noise' is not a number or 'noise_ci' is not an interval", where);
    if (early != NULL &&
        (!json_is_integer(early) || !json_is_integer(json_object_get(c, "too_late"))))
        return err_set(e, "%s: 'too_early' or 'too_late' is not a whole number", where);
    enum verdict v;
    const char *verdict = member_text(c, "verdict");
    if (verdict == NULL || !verdict_parse(verdict, &v) || member_text(c, "reason") == NULL)
        return err_set(e, "%s: 'verdict' or 'reason' is missing or unknown", where);
    return passed == (v == VERDICT_EQUIVALENT) ||
           err_set(e, "%s: 'passed' contradicts 'verdict'", where);
}

bool stated_error_check(const json_t *consistency, const char *path, struct err *e)
{
    if (!json_is_array(consistency))
        return err_set(e, "%s: 'consistency' is not an array", path);
    for (size_t i = 0; i < json_array_size(consistency); i++) {
        char where[512];
        snprintf(where, sizeof where, "%.400s: consistency %zu", path, i + 1);
        if (!check_one(json_array_get(consistency, i), where, e))
            return false;
    }
    return true;
}

enum outcome stated_error_outcome(const json_t *claim)
{
    enum verdict v;
    if (member_text(claim, "verdict") == NULL || !verdict_parse(member_text(claim, "verdict"), &v))
        return OUTCOME_NOT_JUDGED;
    return v == VERDICT_EQUIVALENT  ? OUTCOME_AS_EXPECTED
           : v == VERDICT_DIFFERENT ? OUTCOME_OPPOSITE
                                    : OUTCOME_UNDECIDED;
}

/* The last columns: noise, and pixels that break the stop rule; empty where the scene does not ask. */
static void print_more(FILE *f, const json_t *c, const char *before)
{
    fputs(before, f);
    if (json_object_get(c, "noise") != NULL)
        fprintf(f, "%.3f [%.3f, %.3f]", member_number(c, "noise"), member_end(c, "noise_ci", 0),
                member_end(c, "noise_ci", 1));
    fputs(before, f);
    if (json_object_get(c, "too_early") != NULL)
        fprintf(f, "%.0f + %.0f", member_number(c, "too_early"), member_number(c, "too_late"));
}

void stated_error_print(FILE *f, const json_t *consistency, bool markdown)
{
    if (json_array_size(consistency) == 0)
        return;
    fputs(markdown ? "\n| scene | renders | error squared, between renders / stated [interval] | "
                     "the same of the sum of all pixels | noise / closed form [interval] | pixels "
                     "stopped too early + too late | verdict |\n|---|--:|--:|--:|--:|--:|---|\n"
                   : "\nerror between renders / error that they state, squared; of pixels; of the "
                     "sum of all pixels\n(then noise / closed form; pixels that adaptive sampling "
                     "stopped too early + too late)\n",
          f);
    for (size_t i = 0; i < json_array_size(consistency); i++) {
        const json_t *c = json_array_get(consistency, i);
        if (member_text(c, "error") != NULL) {
            fprintf(f, markdown ? "| %s | | | | | | %s: %s |\n" : "%s  %s: %s\n",
                    member_text(c, "scene"),
                    member_text(c, "verdict") != NULL ? member_text(c, "verdict") : "NOT JUDGED",
                    member_text(c, "error"));
            continue;
        }
        fprintf(f,
                markdown ? "| %s | %.0f x %.0f spp | %.3f [%.3f, %.3f] | %.2f"
                         : "%s  %.0f x %.0f spp  %.3f [%.3f, %.3f]  %.2f",
                member_text(c, "scene"), member_number(c, "renders"), member_number(c, "spp"),
                member_number(c, "pixels"), member_end(c, "pixels_ci", 0),
                member_end(c, "pixels_ci", 1), member_number(c, "image"));
        if (markdown || json_object_get(c, "noise") != NULL ||
            json_object_get(c, "too_early") != NULL)
            print_more(f, c, markdown ? " | " : "  ");
        fprintf(f, markdown ? " | %s |\n" : "  %s\n", member_text(c, "verdict"));
    }
}
