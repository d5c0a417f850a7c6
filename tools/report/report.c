#include "report.h"

#include "renderer/base/fs.h"
#include "tools/html/html.h"
#include "tools/html/page_assets.h"
#include "report_internal.h"
#include "tools/plots/plot_rays.h"
#include "tools/results/plain_words.h"

#include <stdlib.h>
#include <string.h>

/* Worst outcome first, the file's order within. */
static int compare_claims(const void *a, const void *b)
{
    const struct claim_ref *x = a, *y = b;
    if (x->outcome != y->outcome)
        return x->outcome < y->outcome ? -1 : 1;
    return (x->index > y->index) - (x->index < y->index);
}

static void write_claim_list(FILE *f, const json_t *claims, const struct claim_ref *claim,
                             size_t num)
{
    fputs("<ul class=\"lede\">\n", f);
    for (size_t i = 0; i < num; i++) {
        const json_t *c = claim[i].json;
        bool judged = claim[i].outcome != OUTCOME_NOT_JUDGED;
        size_t same = judged ? 1 : results_num_with_error(claims, claim[i].index);
        if (same == 0)
            continue;
        html_print(f, "<li><a href=\"#claim-%zu\">%s</a>", claim[i].index, plain_words_claim(c).s);
        if (same > 1)
            fprintf(f, ", and %zu more", same - 1);
        fputs("</li>\n", f);
    }
    fputs("</ul>\n", f);
}

/* Is the page that of one comparison of two files, for which no verdict was expected beforehand? */
static bool is_comparison(const struct claim_ref *claim, size_t num)
{
    return num == 1 && strcmp(member_text(claim->json, "scene"), "files") == 0;
}

static void write_comparison(FILE *f, const struct claim_ref *claim)
{
    const json_t *c = claim->json;
    const char *title = member_text(c, "title");
    if (title != NULL)
        html_print(f, "<p class=\"lede\"><b>%s</b></p>\n", title);
    html_print(f, "<h1 class=\"%s\">%s</h1>\n<p class=\"lede\"><b>%s</b>: %s</p>\n",
               claim->outcome == OUTCOME_AS_EXPECTED ? "good" : "bad", plain_words_claim(c).s,
               member_text(c, "verdict"), member_text(c, "reason"));
}

/* The headline of the claims, which are sorted worst outcome first. */
static void write_verdict(FILE *f, const json_t *root, const struct claim_ref *claim, size_t num)
{
    static const char *const what[] = {
        [OUTCOME_NOT_JUDGED] = "could not be judged",
        [OUTCOME_OPPOSITE] = "did not come out as expected",
        [OUTCOME_UNDECIDED] = "stayed undecided",
    };
    const json_int_t left = json_integer_value(json_object_get(root, "unfinished"));
    size_t count[4] = {0}, must_differ = 0;
    for (size_t i = 0; i < num; i++) {
        count[claim[i].outcome]++;
        must_differ += claim[i].outcome == OUTCOME_AS_EXPECTED &&
                       strcmp(member_text(claim[i].json, "expected"), "DIFFERENT") == 0;
    }
    if (left > 0)
        fprintf(f,
                "<p class=\"error-line\">The run goes on: %" JSON_INTEGER_FORMAT
                " more are to be judged. This page reloads itself until it has ended.</p>\n",
                left);
    size_t good = count[OUTCOME_AS_EXPECTED], bad = num - good, kinds = 0, said = 0;
    for (int k = 0; k < OUTCOME_AS_EXPECTED; k++)
        kinds += count[k] > 0;
    if (is_comparison(claim, num) && count[OUTCOME_NOT_JUDGED] == 0) {
        write_comparison(f, claim);
        return;
    }
    fprintf(f, "<h1 class=\"%s\">%s", bad > 0 ? "bad" : "good", left > 0 ? "So far " : "");
    if (kinds > 1)
        fprintf(f, "%s %zu claims, ", left > 0 ? "of" : "Of", num);
    for (int k = 0; k < OUTCOME_AS_EXPECTED; k++) {
        if (count[k] == 0)
            continue;
        said++;
        fprintf(f, "%s%zu ", said == 1 ? "" : said < kinds ? ", " : " and ", count[k]);
        if (kinds == 1)
            fprintf(f, "of %zu claim%s ", num, num == 1 ? "" : "s");
        fprintf(f, "%s%s", what[k], said == kinds ? "." : "");
    }
    if (kinds == 0 && num == 1)
        fprintf(f, "%s claim came out as expected.", left > 0 ? "the" : "The");
    else if (kinds == 0)
        fprintf(f, "%s %zu claims came out as expected.", left > 0 ? "all" : "All", num);
    fputs("</h1>\n", f);
    if (num == 1 && count[OUTCOME_NOT_JUDGED] == 0)
        html_print(f, "<p class=\"lede\"><b>%s</b>: %s</p>\n", member_text(claim->json, "verdict"),
                   member_text(claim->json, "reason"));
    if (bad > 0)
        write_claim_list(f, json_object_get(root, "claims"), claim, bad);
    const json_t *margin = json_object_get(root, "engine_margin");
    if (margin != NULL)
        html_print(
            f,
            "<p class=\"lede\">%s declares margins of its own, %g %% of an image and %g %% of a tile, which widen those of "
            "all scenes: %s</p>\n",
            member_or_empty(margin, "engine"), 100 * member_number(margin, "global"),
            100 * member_number(margin, "tile"), member_or_empty(margin, "reason"));
    if (member_text(root, "engine_filter") != NULL)
        html_print(f, "<p class=\"lede\">%s.</p>\n", member_text(root, "engine_filter"));
    const char *located = member_text(root, "located");
    if (located != NULL)
        html_print(f, "<p class=\"lede\">%s</p>\n", located);
    if (must_differ == 1)
        fputs("<p class=\"lede\">1 claim is a deliberate mistake that had to be found, and "
              "was.</p>\n",
              f);
    else if (must_differ > 1)
        fprintf(f,
                "<p class=\"lede\">%zu claims are deliberate mistakes that had to be found, and "
                "were.</p>\n",
                must_differ);
}

static void write_fact(FILE *f, const char *label, const char *text)
{
    if (text != NULL)
        html_print(f, "<div><dt>%s</dt><dd>%s</dd></div>\n", label, text);
}

static void write_header(FILE *f, const json_t *root, const struct claim_ref *claim, size_t num)
{
    fputs("<header>\n<p class=\"kicker\">Assay report</p>\n", f);
    if (num > 0)
        write_verdict(f, root, claim, num);
    report_stated_error_headline(f, json_object_get(root, "consistency"));
    report_noise_headline(f, json_object_get(root, "noise"));
    report_convergence_headline(f, root, num == 0);
    fprintf(f,
            "<p class=\"lede\">The chance that noise alone makes any claim of this page "
            "DIFFERENT is at most %.3g (family-wise alpha), and so is the chance of any wrong "
            "EQUIVALENT.</p>\n",
            member_number(root, "alpha"));
    fputs("<dl class=\"facts\">\n", f);
    write_fact(f, "Date", html_date(member_text(root, "date")).s);
    write_fact(f, "Version", member_text(root, "version"));
    write_fact(f, "Machine", member_text(root, "machine"));
    if (json_object_get(root, "seconds") != NULL)
        write_fact(f, "Time", html_duration(member_number(root, "seconds")).s);
    const char *mode = member_text(root, "mode");
    if (mode != NULL && strcmp(mode, "golden") == 0)
        mode = "golden: against stored references";
    else if (mode != NULL && strcmp(mode, "live") == 0)
        mode = "live: references rendered anew";
    write_fact(f, "Mode", mode);
    html_print(f, "</dl>\n<pre tabindex=\"0\"><code>%s</code></pre>\n</header>\n",
               member_text(root, "command"));
}

/* Moves all claims of claim[0]'s scene to the front, in their order, and returns how many there are.
 * Scenes thus keep the order in which the sorted claims first name them. */
static size_t gather_scene(struct claim_ref *claim, size_t num)
{
    size_t front = 1;
    const char *scene = member_text(claim[0].json, "scene");
    for (size_t i = 1; i < num; i++) {
        if (strcmp(member_text(claim[i].json, "scene"), scene) != 0)
            continue;
        struct claim_ref found = claim[i];
        memmove(&claim[front + 1], &claim[front], (i - front) * sizeof *claim);
        claim[front++] = found;
    }
    return front;
}

static void write_keys(FILE *f)
{
    fputs(
        "<section class=\"how\">\n<h2>How to look</h2>\n<dl class=\"purpose\">\n"
        "<div><dt>Why two right images differ</dt><dd>A path tracer guesses each pixel from random paths. What is left of "
        "that is noise: grain that another seed would put elsewhere. A difference means something only where it is larger "
        "than the noise of both images explains.</dd></div>\n"
        "<div><dt>±, n and t</dt><dd>The standard error ± says how far noise moves a mean, n how often the pixel was "
        "observed. t is a difference divided by its ±: within 2 in 95 of 100 places where nothing is wrong, beyond 4 hardly "
        "ever.</dd></div>\n"
        "<div><dt>p</dt><dd>How often noise alone would make a difference at least as large. Of many places some are small "
        "by chance, so that they are counted together, and a small p may still belong to a difference far inside the "
        "margin.</dd></div>\n"
        "<div><dt>Tiles</dt><dd>Squares of the image, each judged by its own mean: an error that cancels over the whole "
        "image shows there.</dd></div>\n</dl>\n"
        "<p class=\"caption keys\">Each scene has its images "
        "(keys <kbd>1</kbd> to <kbd>9</kbd>; <kbd>0</kbd> side by side), maps of two of them "
        "(<kbd>d</kbd> difference, <kbd>t</kbd> difference over its noise, <kbd>e</kbd> error without "
        "noise, <kbd>v</kbd> variance ratio, <kbd>n</kbd> samples, <kbd>p</kbd> FLIP, what the eye sees), a wipe "
        "(<kbd>w</kbd>), tiles (<kbd>g</kbd>), exposure (<kbd>[</kbd> <kbd>]</kbd>) and zoom (<kbd>+</kbd> "
        "<kbd>-</kbd>, <kbd>f</kbd> the whole image, double click, Ctrl and the wheel, two "
        "fingers); drag to pan. All frames of a scene move together. Point at a pixel, or focus an "
        "image and use the arrow keys, to read its values. A key goes to the scene in the middle "
        "of the window.</p>\n<noscript><p class=\"error-line\">Images and maps are drawn by this "
        "page's own script, which is switched off. Verdicts, numbers and plots are all "
        "here.</p></noscript>\n</section>\n",
        f);
}

/* With more claims than this, the evidence of those that came out as expected is folded. */
enum { FOLD_FROM = 8 };

static bool write_page(struct page *p, const json_t *root, struct claim_ref *claim, size_t num,
                       struct err *e)
{
    FILE *f = p->f;
    p->folded = num > FOLD_FROM;
    char title[128];
    snprintf(title, sizeof title, "Assay report, %.64s", html_date(member_text(root, "date")).s);
    html_page_open(f, title, page_js, member_number(root, "page_every_s"));
    write_header(f, root, claim, num);
    report_matrix(p, claim, num);
    if (num > 0)
        report_table(f, claim, num, p->folded);
    if (num > 0)
        write_keys(f);
    for (size_t done = 0; done < num;) {
        size_t of_scene = gather_scene(claim + done, num - done);
        if (!report_scene(p, claim + done, of_scene, e))
            return false;
        done += of_scene;
        p->num_scenes++;
    }
    report_similarity_table(p);
    if (!plot_rays(f, json_object_get(root, "claims"), e))
        return false;
    report_stated_error(f, json_object_get(root, "consistency"));
    report_noise(f, json_object_get(root, "noise"));
    report_convergence(f, json_object_get(root, "convergence"));
    report_cost(f, root);
    report_pixel_data_write(p);
    fprintf(f, "</main>\n<script>%s</script>\n</body>\n</html>\n", page_js);
    return true;
}

/* Moves the convergence of another results.json into root. */
static bool add_convergence(json_t *root, const char *results_path, const char *path, struct err *e)
{
    json_t *other;
    if (!results_read(path, &other, e))
        return false;
    json_t *convergence = json_object_get(other, "convergence");
    bool ok = true;
    if (convergence == NULL)
        ok = err_set(e, "%s: has no 'convergence'", path);
    else if (json_object_get(root, "convergence") != NULL)
        ok = err_set(e, "%s: has a 'convergence' too", results_path);
    else
        json_object_set(root, "convergence", convergence);
    json_decref(other);
    return ok;
}

bool report_write(const char *results_path, const char *out_path, struct err *e)
{
    return report_write_with(results_path, NULL, out_path, e);
}

/* Writes the page of results that results_read() has checked. */
static bool write_file(struct page *page, const json_t *root, const char *path, struct err *e)
{
    struct results_walk w = {.results = root};
    size_t num = json_array_size(json_object_get(root, "claims"));
    struct out_file out = {0};
    struct claim_ref *claim = calloc(num + 1, sizeof *claim);
    if (claim == NULL)
        return err_set(e, "out of memory for the report");
    while (results_next(&w) && w.kind == JUDGED_CLAIM)
        claim[w.index] = (struct claim_ref){w.json, w.index, w.outcome};
    qsort(claim, num, sizeof *claim, compare_claims);
    bool ok = fs_make_parent_dirs(path, e) && out_open(&out, path, e);
    if (ok) {
        page->f = out.f;
        ok = write_page(page, root, claim, num, e);
        if (ok)
            ok = out_commit(&out, e);
        else
            out_abandon(&out);
    }
    free(claim);
    return ok;
}

bool report_write_with(const char *results_path, const char *converge_path, const char *out_path,
                       struct err *e)
{
    struct page page = {0};
    json_t *root = NULL;
    size_t dir = (size_t)(fs_base(results_path) - results_path);
    if (dir >= sizeof page.dir)
        return err_set(e, "%.64s...: path too long", results_path);
    memcpy(page.dir, results_path, dir);
    bool ok = results_read(results_path, &root, e) &&
              (converge_path == NULL || add_convergence(root, results_path, converge_path, e)) &&
              write_file(&page, root, out_path, e);
    report_pixel_data_free(&page);
    json_decref(root);
    return ok;
}
