#include "convergence_results.h"

#include "reference/suite/suite.h"

#include <stdlib.h>
#include <string.h>

static const char measured[] = "MEASURED";

/* A finite positive number, or null where `may_be_null`. */
static bool check_number(const json_t *object, const char *name, bool positive, bool may_be_null,
                         const char *where, struct err *e)
{
    const json_t *v = json_object_get(object, name);
    if (may_be_null && json_is_null(v))
        return true;
    if (!json_is_number(v) || (positive && !(json_number_value(v) > 0)))
        return err_set(e, "%s: '%s' is not a %snumber", where, name, positive ? "positive " : "");
    return true;
}

static bool check_interval(const json_t *object, const char *name, bool positive, bool may_be_null,
                           const char *where, struct err *e)
{
    const json_t *v = json_object_get(object, name);
    if (may_be_null && json_is_null(v))
        return true;
    return (json_is_interval(v) && (!positive || member_end(object, name, 0) > 0)) ||
           err_set(e, "%s: '%s' is not an interval", where, name);
}

static bool check_text(const json_t *object, const char *name, const char *where, struct err *e)
{
    return json_is_string(json_object_get(object, name)) ||
           err_set(e, "%s: '%s' is not a string", where, name);
}

static bool check_boolean(const json_t *object, const char *name, const char *where, struct err *e)
{
    return json_is_boolean(json_object_get(object, name)) ||
           err_set(e, "%s: '%s' is not true or false", where, name);
}

static bool check_verdict(const json_t *object, const char *name, const char *where, struct err *e)
{
    const char *text = json_string_value(json_object_get(object, name));
    enum verdict v;
    return (text != NULL && (strcmp(text, measured) == 0 || verdict_parse(text, &v))) ||
           err_set(e, "%s: '%s' is not a verdict", where, name);
}

static bool check_rung(const json_t *g, const char *where, struct err *e)
{
    return check_number(g, "spp", true, false, where, e) &&
           check_number(g, "rmse", true, false, where, e) &&
           check_interval(g, "rmse_ci", true, true, where, e) &&
           check_number(g, "variance", true, false, where, e) &&
           check_interval(g, "variance_ci", true, true, where, e) &&
           check_number(g, "bias", false, false, where, e) &&
           check_number(g, "cpu_s", true, false, where, e) &&
           check_number(g, "efficiency", true, true, where, e) &&
           check_interval(g, "efficiency_ci", false, true, where, e);
}

static bool check_rungs(const json_t *owner, const char *where,
                        bool (*check)(const json_t *, const char *, struct err *), struct err *e)
{
    const json_t *rungs = json_object_get(owner, "rungs");
    if (json_array_size(rungs) < 2)
        return err_set(e, "%s: 'rungs' is not an array of at least two", where);
    for (size_t i = 0; i < json_array_size(rungs); i++)
        if (!check(json_array_get(rungs, i), where, e))
            return false;
    return true;
}

static bool check_engine(const json_t *j, const char *where, struct err *e)
{
    if (!check_text(j, "engine", where, e) || !check_boolean(j, "independent", where, e) ||
        !check_boolean(j, "judged", where, e) || !check_boolean(j, "passed", where, e))
        return false;
    bool passed = json_is_true(json_object_get(j, "passed"));
    if (json_object_get(j, "error") != NULL)
        return check_text(j, "error", where, e) &&
               (!passed || err_set(e, "%s: has an 'error' and yet 'passed'", where));
    if (!check_number(j, "slope", false, false, where, e) ||
        !check_interval(j, "slope_ci", false, false, where, e) ||
        !check_interval(j, "floor_ci", false, false, where, e) ||
        !check_verdict(j, "slope_verdict", where, e) ||
        !check_verdict(j, "floor_verdict", where, e) || !check_verdict(j, "verdict", where, e) ||
        !check_text(j, "reason", where, e) || !check_rungs(j, where, check_rung, e))
        return false;
    const char *verdict = member_text(j, "verdict");
    bool good = strcmp(verdict, measured) == 0 || strcmp(verdict, "EQUIVALENT") == 0;
    return good == passed || err_set(e, "%s: 'passed' contradicts 'verdict'", where);
}

static bool check_ratio_rung(const json_t *g, const char *where, struct err *e)
{
    return check_number(g, "spp", true, false, where, e) &&
           check_number(g, "variance", true, false, where, e) &&
           check_interval(g, "variance_ci", true, true, where, e) &&
           check_number(g, "efficiency", true, true, where, e) &&
           check_interval(g, "efficiency_ci", false, true, where, e);
}

bool convergence_results_check_depths(const json_t *depths, const char *where, struct err *e)
{
    const json_t *rungs = json_object_get(depths, "rungs");
    if (json_is_string(json_object_get(depths, "error")))
        return true;
    if (!json_is_integer(json_object_get(depths, "samples")) || json_array_size(rungs) == 0)
        return err_set(e, "%s: 'depths' has no whole 'samples' or no 'rungs'", where);
    for (size_t i = 0; i < json_array_size(rungs); i++) {
        const json_t *g = json_array_get(rungs, i), *depth = json_object_get(g, "depth"),
                     *before = json_object_get(json_array_get(rungs, i - 1), "depth");
        if (!json_is_integer(depth) || json_integer_value(depth) < 0 ||
            (i > 0 && json_integer_value(depth) <= json_integer_value(before)))
            return err_set(e, "%s: 'depths': 'depth' does not ascend in whole numbers", where);
        const json_t *se = json_object_get(g, "se"), *truth = json_object_get(g, "truth");
        if (!json_is_number(json_object_get(g, "mean")) || !json_is_number(se) ||
            json_number_value(se) < 0 || (truth != NULL && !json_is_number(truth)))
            return err_set(e, "%s: 'depths': 'mean', 'se' or 'truth' is not a number", where);
    }
    return true;
}

static bool check_scene(const json_t *s, const char *where, struct err *e)
{
    static const char *const numbers[] = {"width",           "height", "depth",  "replicates",
                                          "reference_noise", "alpha",  "margin", "slope_margin"};
    if (!check_text(s, "scene", where, e) || !check_text(s, "reference", where, e))
        return false;
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        if (!check_number(s, numbers[i], false, false, where, e))
            return false;
    const json_t *engines = json_object_get(s, "engines"), *ratios = json_object_get(s, "ratios");
    if (json_array_size(engines) == 0 || !json_is_array(ratios))
        return err_set(e, "%s: 'engines' or 'ratios' is not such an array", where);
    char inner[600];
    for (size_t i = 0; i < json_array_size(engines); i++) {
        const json_t *j = json_array_get(engines, i);
        const char *name = member_text(j, "engine");
        snprintf(inner, sizeof inner, "%.500s, %.60s", where, name != NULL ? name : "?");
        if (!check_engine(j, inner, e))
            return false;
    }
    for (size_t i = 0; i < json_array_size(ratios); i++) {
        const json_t *j = json_array_get(ratios, i);
        snprintf(inner, sizeof inner, "%.500s, ratio %zu", where, i + 1);
        if (!check_text(j, "a", inner, e) || !check_text(j, "b", inner, e) ||
            !check_rungs(j, inner, check_ratio_rung, e))
            return false;
    }
    const json_t *depths = json_object_get(s, "depths");
    return depths == NULL || convergence_results_check_depths(depths, where, e);
}

bool convergence_results_check(const json_t *convergence, const char *path, struct err *e)
{
    if (json_array_size(convergence) == 0)
        return err_set(e, "%s: 'convergence' is not an array with at least one scene", path);
    for (size_t i = 0; i < json_array_size(convergence); i++) {
        const json_t *s = json_array_get(convergence, i);
        const char *scene = member_text(s, "scene");
        char where[512];
        snprintf(where, sizeof where, "%.300s: convergence of %.60s", path,
                 scene != NULL ? scene : "?");
        if (!check_scene(s, where, e))
            return false;
    }
    return true;
}

static enum outcome outcome_of(const char *verdict)
{
    if (strcmp(verdict, "DIFFERENT") == 0)
        return OUTCOME_OPPOSITE;
    return strcmp(verdict, "INCONCLUSIVE") == 0 ? OUTCOME_UNDECIDED : OUTCOME_AS_EXPECTED;
}

enum outcome convergence_results_outcome(const json_t *engine)
{
    if (json_object_get(engine, "error") != NULL)
        return OUTCOME_NOT_JUDGED;
    return outcome_of(member_text(engine, "verdict"));
}

/* "name [lo, hi]", or without the interval where there is none; "-" where there is no number. */
static void format_value(char *text, size_t size, const json_t *object, const char *name,
                         const char *interval)
{
    if (!json_is_number(json_object_get(object, name)))
        snprintf(text, size, "-");
    else if (json_array_size(json_object_get(object, interval)) == 2)
        snprintf(text, size, "%.3g [%.3g, %.3g]", member_number(object, name),
                 member_end(object, interval, 0), member_end(object, interval, 1));
    else
        snprintf(text, size, "%.3g", member_number(object, name));
}

struct sink {
    void (*row)(void *ctx, const struct convergence_row *r);
    void *ctx;
};

static void emit(const struct sink *s, const char *scene, const char *engine, const char *quantity,
                 const char *value, const char *verdict)
{
    const struct convergence_row r = {scene, engine, quantity, value, verdict, outcome_of(verdict)};
    s->row(s->ctx, &r);
}

static void engine_rows(const struct sink *s, const json_t *scene, const json_t *j)
{
    const char *name = member_text(scene, "scene"), *engine = member_text(j, "engine");
    char text[160], quantity[64];
    if (json_object_get(j, "error") != NULL) {
        const struct convergence_row r = {
            name, engine, "convergence", member_text(j, "error"), "NOT JUDGED", OUTCOME_NOT_JUDGED};
        s->row(s->ctx, &r);
        return;
    }
    const json_t *rungs = json_object_get(j, "rungs");
    const json_t *top = json_array_get(rungs, json_array_size(rungs) - 1);
    snprintf(text, sizeof text, "%+.4f [%+.4f, %+.4f]", member_number(j, "slope"),
             member_end(j, "slope_ci", 0), member_end(j, "slope_ci", 1));
    emit(s, name, engine, "slope of RMSE", text, member_text(j, "slope_verdict"));
    snprintf(quantity, sizeof quantity, "RMS bias at %g spp, %%", member_number(top, "spp"));
    snprintf(text, sizeof text, "%.3f [%.3f, %.3f]", 100 * member_number(top, "bias"),
             100 * member_end(j, "floor_ci", 0), 100 * member_end(j, "floor_ci", 1));
    emit(s, name, engine, quantity, text, member_text(j, "floor_verdict"));
}

static void ratio_row(const struct sink *s, const char *scene, const json_t *ratio, size_t rung,
                      const char *name, const char *interval)
{
    const json_t *g = json_array_get(json_object_get(ratio, "rungs"), rung);
    char quantity[128], text[160];
    snprintf(quantity, sizeof quantity, "%s / %s's at %g spp", name, member_text(ratio, "b"),
             member_number(g, "spp"));
    format_value(text, sizeof text, g, name, interval);
    emit(s, scene, member_text(ratio, "a"), quantity, text, measured);
}

static void ratio_rows(const struct sink *s, const char *scene, const json_t *ratio)
{
    size_t last = json_array_size(json_object_get(ratio, "rungs")) - 1;
    ratio_row(s, scene, ratio, 0, "variance", "variance_ci");
    ratio_row(s, scene, ratio, last, "variance", "variance_ci");
    ratio_row(s, scene, ratio, last, "efficiency", "efficiency_ci");
}

void convergence_results_rows(const json_t *scene,
                              void (*row)(void *ctx, const struct convergence_row *r), void *ctx)
{
    const struct sink s = {row, ctx};
    const json_t *engines = json_object_get(scene, "engines");
    const json_t *ratios = json_object_get(scene, "ratios");
    for (size_t k = 0; k < json_array_size(engines); k++)
        engine_rows(&s, scene, json_array_get(engines, k));
    for (size_t k = 0; k < json_array_size(ratios); k++)
        ratio_rows(&s, member_text(scene, "scene"), json_array_get(ratios, k));
}

static void print_rungs(FILE *f, const json_t *scene)
{
    fprintf(f, "\n%-17s %6s  %-26s %-26s %8s %9s  %s\n", "engine", "spp", "RMSE % [interval]",
            "variance [interval]", "bias %", "CPU ms", "efficiency 1/s [interval]");
    const json_t *engines = json_object_get(scene, "engines");
    for (size_t k = 0; k < json_array_size(engines); k++) {
        const json_t *j = json_array_get(engines, k), *rungs = json_object_get(j, "rungs");
        for (size_t i = 0; i < json_array_size(rungs); i++) {
            const json_t *g = json_array_get(rungs, i);
            char rmse[64], variance[64], efficiency[64];
            snprintf(rmse, sizeof rmse, "%.4g [%.4g, %.4g]", 100 * member_number(g, "rmse"),
                     100 * member_end(g, "rmse_ci", 0), 100 * member_end(g, "rmse_ci", 1));
            format_value(variance, sizeof variance, g, "variance", "variance_ci");
            format_value(efficiency, sizeof efficiency, g, "efficiency", "efficiency_ci");
            fprintf(f, "%-17s %6g  %-26s %-26s %8.3f %9.1f  %s\n", member_text(j, "engine"),
                    member_number(g, "spp"), rmse, variance, 100 * member_number(g, "bias"),
                    1e3 * member_number(g, "cpu_s"), efficiency);
        }
    }
}

static void print_row(void *ctx, const struct convergence_row *r)
{
    fprintf(ctx, "%-17s %-38s %-28s %s\n", r->engine, r->quantity, r->value, r->verdict);
}

void convergence_results_print(FILE *f, const json_t *convergence)
{
    for (size_t i = 0; i < json_array_size(convergence); i++) {
        const json_t *s = json_array_get(convergence, i);
        fprintf(f,
                "%s%s: %.0f x %.0f pixels, %.0f bounces, %.0f replicates a rung\n"
                "reference: %s, RMS noise %.3g %%; intervals at %.6g %% each\n",
                i > 0 ? "\n" : "", member_text(s, "scene"), member_number(s, "width"),
                member_number(s, "height"), member_number(s, "depth"),
                member_number(s, "replicates"), member_text(s, "reference"),
                100 * member_number(s, "reference_noise"), 100 * (1 - member_number(s, "alpha")));
        print_rungs(f, s);
        fprintf(f, "\n%-17s %-38s %-28s %s\n", "engine", "quantity", "value [interval]", "verdict");
        convergence_results_rows(s, print_row, f);
    }
}

static void print_markdown_row(void *ctx, const struct convergence_row *r)
{
    const char *cell[] = {r->scene, r->engine, r->quantity, r->value, r->verdict};
    FILE *f = ctx;
    for (size_t i = 0; i < sizeof cell / sizeof *cell; i++) {
        fputs("| ", f);
        for (const char *c = cell[i]; *c != '\0'; c++) {
            if (strchr("|\\`*_[]", *c) != NULL && i != 3)
                fputc('\\', f);
            fputc(*c == '\n' ? ' ' : *c, f);
        }
        fputc(' ', f);
    }
    fputs("|\n", f);
}

void convergence_results_print_markdown(FILE *f, const json_t *convergence)
{
    fputs("| scene | engine | quantity | value [interval] | verdict |\n|---|---|---|--:|---|\n", f);
    for (size_t i = 0; i < json_array_size(convergence); i++)
        convergence_results_rows(json_array_get(convergence, i), print_markdown_row, f);
}
