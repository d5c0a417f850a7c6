#include "results_matrix.h"

#include "reference/suite/engine_table.h"

#include <string.h>

static const json_t *find(const json_t *claims, const char *scene, const char *b)
{
    json_each(c, claims) {
        if (strcmp(member_text(c, "scene"), scene) == 0 &&
            strcmp(member_text(c, "a"), "pathtracer") == 0 && strcmp(member_text(c, "b"), b) == 0)
            return c;
    }
    return NULL;
}

static void print_cell(FILE *f, const json_t *c)
{
    if (c == NULL) {
        fputs(" |", f);
        return;
    }
    if (results_claim_outcome(c) == OUTCOME_NOT_JUDGED) {
        fputs(results_claim_lacks_time(c) ? " **INCONCLUSIVE** |" : " **NOT JUDGED** |", f);
        return;
    }
    bool as_expected = results_claim_outcome(c) == OUTCOME_AS_EXPECTED;
    const char *verdict = member_text(c, "verdict"), *mark = "";
    if (!as_expected)
        mark = verdict;
    else if (strcmp(verdict, "DIFFERENT") == 0)
        mark = "DIFFERENT";
    double mdb = 100 * member_number(c, "mdb_global");
    char mdb_text[16] = "-"; /* no test covers the whole image */
    if (mdb < 100)
        snprintf(mdb_text, sizeof mdb_text, "%.2f", mdb);
    fprintf(f, " %s%s%s%s%+.3f ± %.3f, %s |", as_expected ? "" : "**", mark,
            as_expected ? "" : "**", mark[0] != '\0' ? " " : "",
            100 * member_number(c, "difference"),
            50 * (member_end(c, "ci", 1) - member_end(c, "ci", 0)), mdb_text);
}

static void print_claims(FILE *f, const json_t *claims)
{
    fputs("| scene | truth |", f);
    for (int k = 0; engine_names[k] != NULL; k++)
        fprintf(f, " %s |", engine_table[k].title);
    fputs("\n|---|--:|", f);
    for (int k = 0; engine_names[k] != NULL; k++)
        fputs("--:|", f);
    fputc('\n', f);
    for (size_t i = 0; i < json_array_size(claims); i++) {
        const char *scene = member_text(json_array_get(claims, i), "scene");
        if (!results_is_first_of_scene(claims, i))
            continue;
        fprintf(f, "| %s |", scene);
        print_cell(f, find(claims, scene, "truth"));
        for (int k = 0; engine_names[k] != NULL; k++)
            print_cell(f, find(claims, scene, engine_names[k]));
        fputc('\n', f);
    }
}

static const json_t *engine_of(const json_t *scene, const char *name)
{
    const json_t *engines = json_object_get(scene, "engines");
    json_each(e, engines) {
        if (strcmp(member_text(e, "engine"), name) == 0 && json_object_get(e, "error") == NULL)
            return e;
    }
    return NULL;
}

/* The ratios of `a` to the first engine of the table, at the first or the last rung; NULL: none. */
static const json_t *ratio_of(const json_t *scene, const char *a, bool last)
{
    const json_t *ratios = json_object_get(scene, "ratios");
    json_each(r, ratios) {
        const json_t *rungs = json_object_get(r, "rungs");
        if (strcmp(member_text(r, "a"), a) == 0 &&
            strcmp(member_text(r, "b"), engine_names[0]) == 0)
            return json_array_get(rungs, last ? json_array_size(rungs) - 1 : 0);
    }
    return NULL;
}

static void print_verdict(FILE *f, const json_t *engine, const char *name)
{
    const char *verdict = member_text(engine, name);
    if (verdict != NULL && strcmp(verdict, "EQUIVALENT") != 0 && strcmp(verdict, "MEASURED") != 0)
        fprintf(f, " **%s**", verdict);
}

static void print_slope(FILE *f, const json_t *engine)
{
    fputs(" |", f);
    if (engine == NULL)
        return;
    fprintf(f, " %.3f ± %.3f", member_number(engine, "slope"),
            (member_end(engine, "slope_ci", 1) - member_end(engine, "slope_ci", 0)) / 2);
    print_verdict(f, engine, "slope_verdict");
}

static void print_bias(FILE *f, const json_t *engine)
{
    fputs(" |", f);
    if (engine == NULL)
        return;
    fprintf(f, " %.2f", 100 * member_end(engine, "floor_ci", 1));
    print_verdict(f, engine, "floor_verdict");
}

static void print_ratio(FILE *f, const json_t *rung, const char *name, const char *interval)
{
    fputs(" |", f);
    if (!json_is_number(json_object_get(rung, name)))
        return;
    fprintf(f, " %.2f", member_number(rung, name));
    if (json_array_size(json_object_get(rung, interval)) == 2)
        fprintf(f, " [%.2f, %.2f]", member_end(rung, interval, 0), member_end(rung, interval, 1));
}

static void print_convergence(FILE *f, const json_t *convergence)
{
    const char *other = engine_table[0].title;
    fprintf(
        f,
        "| scene | slope, ours | Sobol | %s | bias at most %%, ours | Sobol | variance / %s', ours, "
        "first | top | Sobol, top | efficiency / %s', Sobol |\n"
        "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n",
        other, other, other);
    json_each(scene, convergence) {
        const json_t *ours = engine_of(scene, "pathtracer");
        const json_t *sobol = engine_of(scene, "pathtracer-sobol");
        fprintf(f, "| %s", member_text(scene, "scene"));
        print_slope(f, ours);
        print_slope(f, sobol);
        print_slope(f, engine_of(scene, engine_names[0]));
        print_bias(f, ours);
        print_bias(f, sobol);
        print_ratio(f, ratio_of(scene, "pathtracer", false), "variance", "variance_ci");
        print_ratio(f, ratio_of(scene, "pathtracer", true), "variance", "variance_ci");
        print_ratio(f, ratio_of(scene, "pathtracer-sobol", true), "variance", "variance_ci");
        print_ratio(f, ratio_of(scene, "pathtracer-sobol", true), "efficiency", "efficiency_ci");
        fputs(" |\n", f);
    }
}

void results_matrix_print(FILE *f, const json_t *results)
{
    const json_t *claims = json_object_get(results, "claims"),
                 *convergence = json_object_get(results, "convergence");
    if (json_array_size(claims) > 0)
        print_claims(f, claims);
    if (json_array_size(claims) > 0 && convergence != NULL)
        fputc('\n', f);
    if (convergence != NULL)
        print_convergence(f, convergence);
}
