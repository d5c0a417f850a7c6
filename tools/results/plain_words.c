#include "plain_words.h"

#include "tools/compare/verdict.h"
#include "tools/stats/pair_noise.h"

#include <math.h>
#include <string.h>

enum { MOST_FAILURES = 3, MOST_NAMES = 16 };

/* 1 or -1 if the whole interval lies above or below the margin, else 0. */
static int outside(const json_t *object, const char *key, double margin)
{
    const json_t *ci = json_object_get(object, key);
    const double lo = json_number_value(json_array_get(ci, 0)),
                 hi = json_number_value(json_array_get(ci, 1));
    return lo > margin ? 1 : hi < -margin ? -1 : 0;
}

static bool is_inside(const json_t *object, const char *key, double lo, double hi)
{
    const json_t *ci = json_object_get(object, key);
    return ci != NULL && json_number_value(json_array_get(ci, 0)) >= lo &&
           json_number_value(json_array_get(ci, 1)) <= hi;
}

/* "1.3 % too bright", or by a factor where per cent would be a large number. */
static struct plain_words amount(double difference)
{
    struct plain_words w;
    const double percent = 100 * fabs(difference);
    if (difference > 9)
        snprintf(w.s, sizeof w.s, "%.3g times as bright", 1 + difference);
    else
        snprintf(w.s, sizeof w.s, "%.*f %% too %s",
                 percent < 0.095  ? 3
                 : percent < 0.95 ? 2
                                  : 1,
                 percent, difference > 0 ? "bright" : "dark");
    return w;
}

struct plain_words plain_words_noise(const json_t *claim)
{
    struct plain_words w = {""};
    const json_t *ratio = json_object_get(claim, "variance_ratio");
    const double limit = 1 + member_number(claim, "margin_variance"),
                 lo = json_number_value(json_array_get(json_object_get(ratio, "ci"), 0)),
                 hi = json_number_value(json_array_get(json_object_get(ratio, "ci"), 1));
    if (ratio != NULL && limit > 1 && (lo > limit || hi < 1 / limit))
        snprintf(w.s, sizeof w.s, "%s noisy, %.3g times the variance", lo > limit ? "more" : "less",
                 member_number(ratio, "ratio"));
    return w;
}

/* " in the .. pixels at ..", or nothing where the region is the image: it begins at 0,0 and reaches into the last tile. */
static struct plain_words place(const json_t *claim, const json_t *region)
{
    struct plain_words w = {""};
    const double x = member_number(region, "x"), y = member_number(region, "y"),
                 width = member_number(region, "width"), height = member_number(region, "height"),
                 tile = member_number(claim, "tile");
    const bool is_image = x == 0 && y == 0 && tile > 0 &&
                          width > tile * (member_number(claim, "tiles_x") - 1) &&
                          height > tile * (member_number(claim, "tiles_y") - 1);
    if (!is_image)
        snprintf(w.s, sizeof w.s, " in the %.0f x %.0f pixels at %.0f,%.0f", width, height, x, y);
    return w;
}

/* "1.3 % too bright in red in the .. pixels at ..", of a region. */
static struct plain_words amount_and_place(const json_t *claim, const json_t *region)
{
    static const char *const channels[] = {" in red", " in green", " in blue", ""};
    struct plain_words w;
    const int channel = (int)member_number(region, "channel");
    snprintf(w.s, sizeof w.s, "%.64s%s%.64s", amount(member_number(region, "difference")).s,
             channel >= 0 && channel < 3 ? channels[channel] : "", place(claim, region).s);
    return w;
}

/* Of a claim that is undecided: does a difference that is not noise reach over its margin? */
static bool is_near_margin(const json_t *claim)
{
    const json_t *region = json_object_get(claim, "significant");
    const double margin = member_number(region, "margin");
    return region != NULL && !is_inside(region, "ci", -margin, margin);
}

/* Is the mean the same and the variance not known to be? */
static bool only_the_variance_is_open(const json_t *claim)
{
    const double limit = 1 + member_number(claim, "margin_variance");
    return limit > 1 &&
           !is_inside(json_object_get(claim, "variance_ratio"), "ci", 1 / limit, limit) &&
           is_inside(claim, "ci", -member_number(claim, "margin_global"),
                     member_number(claim, "margin_global")) &&
           is_inside(json_object_get(claim, "worst_tile"), "ci",
                     -member_number(claim, "margin_tile"), member_number(claim, "margin_tile")) &&
           !(member_number(claim, "extra_factor") > 1); /* judge_variance(): the mean is decided */
}

static struct plain_words too_bright(const json_t *claim)
{
    const json_t *tile = json_object_get(claim, "worst_tile"),
                 *worst = json_object_get(claim, "worst");
    if (outside(claim, "ci", member_number(claim, "margin_global")) != 0)
        return amount(member_number(claim, "difference"));
    struct plain_words w;
    if (outside(tile, "ci", member_number(claim, "margin_tile")) != 0) {
        snprintf(w.s, sizeof w.s, "%.64s%.64s", amount(member_number(tile, "difference")).s,
                 place(claim, tile).s);
        return w;
    }
    if (plain_words_noise(claim).s[0] != '\0')
        return plain_words_noise(claim);
    if (member_number(worst, "difference") != 0 && member_number(worst, "width") > 0)
        return amount_and_place(claim, worst);
    snprintf(w.s, sizeof w.s, "not the same, most of all%.64s", place(claim, tile).s);
    return w;
}

/* " on SCENE": a comparison of two files has none. */
static struct plain_words on_scene(const json_t *claim)
{
    const char *scene = member_or_empty(claim, "scene");
    struct plain_words w = {""};
    if (strcmp(scene, "files") != 0)
        snprintf(w.s, sizeof w.s, " on %.100s", scene);
    return w;
}

static double replicates(const json_t *claim, const char *unit, const char *n, double times)
{
    return strcmp(member_or_empty(claim, unit), "replicate") == 0
               ? ceil(times * member_number(claim, n))
               : 0;
}

/* extra_factor is about both sides. Where the reference has little of the noise, more samples of A alone do the same. */
struct plain_words plain_words_more_samples(const json_t *claim)
{
    struct plain_words w = {""};
    const double factor = member_number(claim, "extra_factor");
    const json_t *share = json_object_get(claim, "noise_share_a");
    const double alone =
        pair_noise_samples_of_a(share != NULL ? json_number_value(share) : 1, factor);
    const bool both = alone > 2 * factor, in_words = factor >= verdict_largest_factor;
    const double times = both || in_words ? factor : alone;
    char more[128];
    if (!(factor > 1)) /* 1: nobody knows */
        return w;
    verdict_more_samples(times, both ? "samples on both sides" : "samples", is_near_margin(claim),
                         more);
    const double num_a = in_words ? 0 : replicates(claim, "unit_a", "n_a", times),
                 num_b = both ? replicates(claim, "unit_b", "n_b", times) : 0;
    size_t at = (size_t)snprintf(w.s, sizeof w.s, "%s", more);
    if (num_a > 0)
        at += (size_t)snprintf(w.s + at, sizeof w.s - at, ": %.0f replicates", num_a);
    if (num_a > 0 && num_b > 0)
        snprintf(w.s + at, sizeof w.s - at, ", and %.0f of the reference", num_b);
    return w;
}

struct plain_words plain_words_claim(const json_t *claim)
{
    struct plain_words w;
    const char *a = member_or_empty(claim, "a"), *b = member_or_empty(claim, "b"),
               *verdict = member_or_empty(claim, "verdict"), *error = member_text(claim, "error");
    const struct plain_words scene = on_scene(claim);
    const enum outcome outcome = results_claim_outcome(claim);
    if (outcome == OUTCOME_NOT_JUDGED)
        snprintf(w.s, sizeof w.s, "%.100s could not be judged: %.400s", a,
                 error != NULL ? error : "");
    else if (strcmp(verdict, "DIFFERENT") == 0)
        snprintf(w.s, sizeof w.s, "%.100s is %.200s%.110s (against %.100s)", a, too_bright(claim).s,
                 scene.s, b);
    else if (json_is_true(json_object_get(claim, "same_bits")))
        snprintf(w.s, sizeof w.s, "%.100s makes the same bits%.110s (as %.100s)", a, scene.s, b);
    else if (strcmp(verdict, "EQUIVALENT") == 0)
        snprintf(w.s, sizeof w.s, "%.100s is the same%.110s (as %.100s), within %.3g %%%s", a,
                 scene.s, b, 100 * member_number(claim, "margin_global"),
                 member_number(claim, "margin_variance") > 0 ? ", and so is its noise" : "");
    else if (strcmp(verdict, "INCONCLUSIVE") == 0 && only_the_variance_is_open(claim)) {
        const char *reason = member_or_empty(claim, "reason"), *mean = strstr(reason, "; mean: ");
        const int length = mean != NULL ? (int)(mean - reason) : (int)strlen(reason);
        snprintf(w.s, sizeof w.s,
                 "%.100s has the same mean%.110s (as %.100s), within %.3g %%, but %.*s", a, scene.s,
                 b, 100 * member_number(claim, "margin_global"), length < 200 ? length : 200,
                 reason);
    } else if (strcmp(verdict, "INCONCLUSIVE") == 0) {
        const struct plain_words more = plain_words_more_samples(claim);
        const char *colon = more.s[0] != '\0' ? ": " : "";
        const json_t *region = json_object_get(claim, "significant");
        if (is_near_margin(claim))
            snprintf(w.s, sizeof w.s,
                     "%.100s is %.120s%.110s (against %.100s), which is not noise, but may be "
                     "within the margin of %.3g %%%s%.140s",
                     a, amount_and_place(claim, region).s, scene.s, b,
                     100 * member_number(region, "margin"), colon, more.s);
        else
            snprintf(w.s, sizeof w.s, "%.100s is too noisy to tell%.110s (against %.100s)%s%.200s",
                     a, scene.s, b, colon, more.s);
    } else
        snprintf(
            w.s, sizeof w.s,
            "no difference of %.100s was found%.110s (against %.100s); %.3g %% would have been", a,
            scene.s, b, 100 * member_number(claim, "mdb_global"));
    return w;
}

/* The distinct values of a key, variants left out: "a, b and c"; beyond six "and other NOUN". */
static struct plain_words names(const json_t *claims, const char *key, const char *noun)
{
    const char *name[MOST_NAMES + 1];
    struct plain_words w = {""};
    size_t num = 0, at = 0;
    for (size_t i = 0; i < json_array_size(claims); i++) {
        const char *text = member_or_empty(json_array_get(claims, i), key);
        size_t k = 0;
        while (k < num && !results_is_variant_of(text, name[k]))
            k++;
        if (k == num && num < MOST_NAMES)
            name[num++] = text;
    }
    for (size_t k = 0; k < num && k < 6 && at < sizeof w.s - 1; k++)
        at += (size_t)snprintf(w.s + at, sizeof w.s - at, "%s%.80s",
                               k == 0                     ? ""
                               : k + 1 == num && num <= 6 ? " and "
                                                          : ", ",
                               name[k]);
    if (num > 6 && at < sizeof w.s)
        snprintf(w.s + at, sizeof w.s - at, " and other %s", noun);
    return w;
}

static size_t num_scenes(const json_t *claims)
{
    size_t num = 0;
    for (size_t i = 0; i < json_array_size(claims); i++)
        num += results_is_first_of_scene(claims, i);
    return num;
}

/* A few failures: claims, what differs first, then stated errors and noise. bad: the number of all failures. */
static void print_failures(FILE *f, const json_t *results, size_t bad)
{
    const json_t *claims = json_object_get(results, "claims");
    static const enum outcome order[] = {OUTCOME_OPPOSITE, OUTCOME_NOT_JUDGED, OUTCOME_UNDECIDED};
    size_t said = 0, covered = 0;
    for (size_t o = 0; o < sizeof order / sizeof *order; o++)
        for (size_t i = 0; i < json_array_size(claims) && said < MOST_FAILURES; i++) {
            const json_t *claim = json_array_get(claims, i);
            const size_t same =
                order[o] == OUTCOME_NOT_JUDGED ? results_num_with_error(claims, i) : 1;
            if (results_claim_outcome(claim) != order[o] || same == 0)
                continue;
            fprintf(f, "%s%s", said++ == 0 ? ": " : "; ", plain_words_claim(claim).s);
            covered += same;
        }
    struct results_walk w = {.results = results, .kind = JUDGED_STATED_ERROR};
    while (said < MOST_FAILURES && results_next(&w) && w.kind != JUDGED_CONVERGENCE) {
        if (w.outcome == OUTCOME_AS_EXPECTED)
            continue;
        fputs(said++ == 0 ? ": " : "; ", f);
        if (w.kind == JUDGED_STATED_ERROR)
            fprintf(f, "the errors that renders of %s state are not those they have", w.scene);
        else
            fprintf(
                f, "noise of %s in %s: %s", member_or_empty(w.json, "engine"), w.scene,
                member_or_empty(w.json, member_text(w.json, "error") != NULL ? "error" : "reason"));
        covered++;
    }
    if (bad > covered)
        fprintf(f, "; and %zu more", bad - covered);
}

/* Of a claim that is inside its margin: the share of the margin that a difference has at least, noise taken off; 0: none
 * is more than noise. */
static double share_of_margin(const json_t *claim)
{
    const json_t *region = json_object_get(claim, "significant"),
                 *ci = json_object_get(region, "ci");
    const double lo = json_number_value(json_array_get(ci, 0)),
                 hi = json_number_value(json_array_get(ci, 1));
    const bool is_known = region != NULL &&
                          strcmp(member_or_empty(claim, "verdict"), "EQUIVALENT") == 0 &&
                          results_claim_outcome(claim) == OUTCOME_AS_EXPECTED;
    return is_known ? fmax(lo, -hi) / member_number(region, "margin") : 0;
}

/* A difference that matters to nobody, by the margin, is still one: a new version has it, or the margin is too wide. */
static void print_inside(FILE *f, const json_t *claims)
{
    const json_t *most = NULL;
    size_t num = 0;
    json_each(claim, claims) {
        num += share_of_margin(claim) > 0;
        if (share_of_margin(claim) > (most != NULL ? share_of_margin(most) : 0))
            most = claim;
    }
    if (num == 0)
        return;
    const json_t *region = json_object_get(most, "significant");
    fprintf(
        f,
        "\nnote:   %.100s is %s%.110s (against %.100s), which is not noise, but within its %.3g %%",
        member_or_empty(most, "a"), amount_and_place(most, region).s, on_scene(most).s,
        member_or_empty(most, "b"), 100 * member_number(region, "margin"));
    if (num > 1)
        fprintf(f, "; and %zu more", num - 1);
}

/* num: the claims that found no difference, as they should. */
static void print_the_same(FILE *f, const json_t *claims, size_t num)
{
    size_t bits = 0;
    json_each(claim, claims)
        bits += json_is_true(json_object_get(claim, "same_bits"));
    if (bits == num)
        fprintf(f, ", %zu the same to the bit", num);
    else
        fprintf(f, ", %zu the same within their margins", num);
    if (bits > 0 && bits < num)
        fprintf(f, " (%zu of them to the bit)", bits);
}

void plain_words_print(FILE *f, const json_t *results, const char *page)
{
    const json_t *claims = json_object_get(results, "claims"),
                 *noise = json_object_get(results, "noise");
    const size_t num = json_array_size(claims), scenes = num_scenes(claims),
                 num_stated = json_array_size(json_object_get(results, "consistency")),
                 noisy = num_scenes(noise);
    size_t mistakes = 0, bad = 0;
    for (struct results_walk w = {.results = results};
         results_next(&w) && w.kind != JUDGED_CONVERGENCE;) {
        bad += w.outcome != OUTCOME_AS_EXPECTED;
        mistakes += w.kind == JUDGED_CLAIM && w.outcome == OUTCOME_AS_EXPECTED &&
                    strcmp(member_or_empty(w.json, "expected"), "DIFFERENT") == 0;
    }
    if (num > 0)
        fprintf(f, "\njudged: %s on %zu scene%s against %s: %zu comparison%s",
                names(claims, "a", "programs").s, scenes, scenes == 1 ? "" : "s",
                names(claims, "b", "references").s, num, num == 1 ? "" : "s");
    else
        fputs("\njudged: no means", f);
    if (num_stated > 0)
        fprintf(f, ", and the stated errors of %zu scene%s", num_stated,
                num_stated == 1 ? "" : "s");
    if (noisy > 0)
        fprintf(f, ", and the noise of %zu scene%s", noisy, noisy == 1 ? "" : "s");
    if (bad == 0) {
        fputs("\nresult: all as it should be", f);
        if (num > mistakes)
            print_the_same(f, claims, num - mistakes);
        if (mistakes > 0)
            fprintf(f, ", %zu deliberate mistake%s found", mistakes, mistakes == 1 ? "" : "s");
    } else {
        fprintf(f, "\nresult: %zu of %zu not as it should be", bad,
                num + num_stated + json_array_size(noise));
        print_failures(f, results, bad);
    }
    print_inside(f, claims);
    fprintf(f, "\nlook:   %s\n", page);
}
