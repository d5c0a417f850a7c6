#include "github_annotations.h"

#include "noise_results.h"
#include "stated_error_results.h"
#include "convergence_results.h"
#include "results.h"

#include <string.h>

/* What would end the text of a command, or, in a property, end the property. */
static void print_escaped(FILE *f, const char *s, bool property)
{
    for (; s != NULL && *s != '\0'; s++) {
        unsigned char c = (unsigned char)*s;
        if (c == '%' || c < 0x20 || c == 0x7f || (property && (c == ':' || c == ',')))
            fprintf(f, "%%%02X", c);
        else
            fputc(c, f);
    }
}

struct tally {
    size_t num, wrong, undecided, errors;
};

static void count(struct tally *t, enum outcome outcome, bool lacks_time)
{
    t->num++;
    t->wrong += outcome == OUTCOME_OPPOSITE;
    t->undecided += outcome == OUTCOME_UNDECIDED || lacks_time;
    t->errors += outcome == OUTCOME_NOT_JUDGED && !lacks_time;
}

static void print_title(FILE *f, enum outcome outcome, bool lacks_time, const char *scene)
{
    fprintf(f, "::%s title=", outcome == OUTCOME_UNDECIDED || lacks_time ? "warning" : "error");
    print_escaped(f, scene, true);
}

static void print_claim(FILE *f, const json_t *claims, size_t i)
{
    const json_t *claim = json_array_get(claims, i);
    enum outcome outcome = results_claim_outcome(claim);
    size_t num = outcome == OUTCOME_NOT_JUDGED ? results_num_with_error(claims, i) : 1;
    if (outcome == OUTCOME_AS_EXPECTED || num == 0)
        return;
    print_title(f, outcome, results_claim_lacks_time(claim), member_text(claim, "scene"));
    fputs("%3A ", f);
    print_escaped(f, member_text(claim, "a"), true);
    fputs(" against ", f);
    print_escaped(f, member_text(claim, "b"), true);
    if (num > 1)
        fprintf(f, " and %zu more", num - 1);
    fputs("::", f);
    if (outcome == OUTCOME_NOT_JUDGED) {
        fputs(results_claim_lacks_time(claim) ? "INCONCLUSIVE: " : "could not be judged: ", f);
        print_escaped(f, member_text(claim, "error"), false);
    } else {
        print_escaped(f, member_text(claim, "verdict"), false);
        fputs(", expected ", f);
        print_escaped(f, member_text(claim, "expected"), false);
        fputs(": ", f);
        print_escaped(f, member_text(claim, "reason"), false);
        fprintf(f, " (difference %+.3g %%25)", 100 * member_number(claim, "difference"));
    }
    if (member_text(claim, "rerun") != NULL) {
        fputs("%0Aagain: ", f);
        print_escaped(f, member_text(claim, "rerun"), false);
    }
    fputc('\n', f);
}

static struct tally tally_of(const json_t *results)
{
    struct tally t = {0};
    const json_t *claims = json_object_get(results, "claims"),
                 *consistency = json_object_get(results, "consistency"),
                 *convergence = json_object_get(results, "convergence");
    for (size_t i = 0; i < json_array_size(claims); i++) {
        const json_t *c = json_array_get(claims, i);
        count(&t, results_claim_outcome(c), results_claim_lacks_time(c));
    }
    for (size_t i = 0; i < json_array_size(consistency); i++)
        count(&t, stated_error_outcome(json_array_get(consistency, i)), false);
    const json_t *noise = json_object_get(results, "noise");
    for (size_t i = 0; i < json_array_size(noise); i++)
        count(&t, noise_results_outcome(json_array_get(noise, i)), false);
    for (size_t i = 0; i < json_array_size(convergence); i++) {
        const json_t *engines = json_object_get(json_array_get(convergence, i), "engines");
        for (size_t k = 0; k < json_array_size(engines); k++)
            count(&t, convergence_results_outcome(json_array_get(engines, k)), false);
    }
    return t;
}

void github_annotations_headline(FILE *f, const json_t *results)
{
    struct tally t = tally_of(results);
    if (t.wrong + t.undecided + t.errors == 0)
        fprintf(f, "All %zu claims came out as expected.", t.num);
    else
        fprintf(f,
                "Of %zu claims %zu came out wrong, %zu stayed undecided and %zu could not be "
                "judged.",
                t.num, t.wrong, t.undecided, t.errors);
}

static void print_other(FILE *f, const char *what, const json_t *object, enum outcome outcome,
                        const char *scene)
{
    if (outcome == OUTCOME_AS_EXPECTED)
        return;
    print_title(f, outcome, false, scene);
    fprintf(f, "%%3A %s::", what);
    const char *error = member_text(object, "error"), *verdict = member_text(object, "verdict");
    print_escaped(f, error != NULL ? error : verdict != NULL ? verdict : "not as expected", false);
    fputc('\n', f);
}

void github_annotations_print(FILE *f, const json_t *results)
{
    const json_t *claims = json_object_get(results, "claims"),
                 *consistency = json_object_get(results, "consistency"),
                 *convergence = json_object_get(results, "convergence");
    for (size_t i = 0; i < json_array_size(claims); i++)
        print_claim(f, claims, i);
    for (size_t i = 0; i < json_array_size(consistency); i++) {
        const json_t *c = json_array_get(consistency, i);
        print_other(f, "stated errors", c, stated_error_outcome(c), member_text(c, "scene"));
    }
    const json_t *noise = json_object_get(results, "noise");
    for (size_t i = 0; i < json_array_size(noise); i++) {
        const json_t *c = json_array_get(noise, i);
        print_other(f, "noise", c, noise_results_outcome(c), member_text(c, "scene"));
    }
    for (size_t i = 0; i < json_array_size(convergence); i++) {
        const json_t *scene = json_array_get(convergence, i),
                     *engines = json_object_get(scene, "engines");
        for (size_t k = 0; k < json_array_size(engines); k++) {
            const json_t *j = json_array_get(engines, k);
            print_other(f, "convergence", j, convergence_results_outcome(j),
                        member_text(scene, "scene"));
        }
    }
    fputs("::notice title=assay::", f);
    github_annotations_headline(f, results);
    fputc('\n', f);
}
