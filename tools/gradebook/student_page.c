/* The page of one submission: what is wrong, where the points went, then each check that lost some,
 * with what was expected, what was seen and where; checks with all points are folded. */
#include "student_page.h"

#include "grade_change.h"
#include "grade_images.h"
#include "grade_needs.h"
#include "renderer/base/fs.h"
#include "renderer/base/shell_quote.h"
#include "tools/html/html.h"
#include "tools/results/results.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct page {
    FILE *f;
    const char *dir;
    const json_t *grade; /* for a student what he may see of it (student_view()) */
    bool staff;
    const struct rubric *rubric; /* on staff's pages; NULL: none */
    const struct answer_key *answers;
    bool left_out; /* there are checks that are not shown */
};

static void paragraph(FILE *f, const char *label, const char *text, const char *class)
{
    if (text[0] != '\0')
        html_print(f, "<p class=\"%s\"><b>%s</b> %s</p>\n", class, label, text);
}

/* The chance that another run gets other points, of a check or of all of them. */
static void show_chance(FILE *f, double chance, bool moves, const char *here)
{
    fputs("<p class=\"where\">", f);
    if (moves)
        fputs("Between none and all, points move a little with the noise of each run.", f);
    else if (chance >= 1)
        fprintf(f, "Another run of the same program may get other points%s.", here);
    else if (chance >= 1e-4)
        fprintf(f, "Another run of the same program gets other points%s with a chance of %.2g %%.",
                here, 100 * chance);
    else
        fprintf(f, "Another run of the same program gets the same points%s, but for 1 in 10 000.",
                here);
    fputs("</p>\n", f);
}

/* Is nothing known of what another run would get in some check (grade_batch.c)? */
static bool may_change(const json_t *grade)
{
    json_each(c, json_object_get(grade, "checks")) {
        const double share = member_number(c, "share");
        if (member_number(c, "chance") >= 1 && (share <= 0 || share >= 1) &&
            member_text(c, "appeal") == NULL)
            return true;
    }
    return false;
}

/* Does it stand before the fold? */
static bool stands_out(const struct page *p, const json_t *check)
{
    return !grade_is_full(check) || grade_is_provisional(check) ||
           member_text(check, "appeal") != NULL ||
           (p->staff && (member_or_empty(check, "flag")[0] != '\0' ||
                         !json_is_true(json_object_get(check, "judged"))));
}

static const json_t *image_of(const json_t *grade, const char *name)
{
    return member_named(json_object_get(grade, "pictures"), name);
}

/* The image's reference, with the deviations that the submission was graded with; NULL: none is
 * shown. */
static const struct moments *reference_of(const struct page *p, const char *name)
{
    const struct rubric *r = p->rubric;
    for (int i = 0; r != NULL && p->answers != NULL && i < r->num_images; i++)
        if (strcmp(r->image[i].name, name) == 0)
            return answer_key_image(p->answers,
                                    answer_key_set(r, member_or_empty(p->grade, "accepted")), i);
    return NULL;
}

/* An image, for staff beside its reference; nothing where there is none. */
static bool show_image(const struct page *p, const char *name, const json_t *tile, struct err *e)
{
    const char *curve =
        p->rubric != NULL && p->rubric->curve[0] != '\0' ? p->rubric->curve : "srgb";
    const json_t *image = image_of(p->grade, name);
    const struct path path = fs_path("%s/%s/%s", p->dir, member_or_empty(p->grade, "id"),
                                     member_or_empty(image, "file"));
    return !json_is_string(json_object_get(image, "sha256")) ||
           grade_images(p->f, path.s, name, tile, reference_of(p, name), p->staff ? curve : NULL,
                        e);
}

static bool show_evidence(const struct page *p, const json_t *c, struct err *e)
{
    const char *name = member_or_empty(c, "picture");
    const json_t *image = image_of(p->grade, name);
    if (!show_image(p, name, json_object_get(c, "tile"), e))
        return false;
    if (json_is_string(json_object_get(image, "sha256"))) {
        grade_plot_difference(p->f, c, member_number(image, "width"),
                              member_number(image, "height"));
        grade_plot_intervals(p->f, c);
    }
    return true;
}

static bool show_check(const struct page *p, const json_t *c, struct err *e)
{
    FILE *f = p->f;
    double share = member_number(c, "share");
    bool full = grade_is_full(c), judged = json_is_true(json_object_get(c, "judged"));
    const char *visibility = member_or_empty(c, "visibility");
    html_print(f, "<section id=\"check-%s\"><h3>%s <span class=\"%s\">%.2f of %g</span>",
               member_text(c, "name"), member_text(c, "title"), full ? "full" : "lost",
               member_number(c, "points"), member_number(c, "of"));
    if (grade_is_provisional(c))
        fputs(" <span class=\"badge error\">provisional</span>", f);
    if (!judged)
        fputs(" <span class=\"badge error\">not judged</span>", f);
    if (strcmp(visibility, "visible") != 0)
        html_print(f, " <span class=\"badge\">%s</span>", visibility);
    fputs("</h3>\n", f);
    if (p->staff)
        paragraph(f, "For you to look at:", member_or_empty(c, "flag"), "error-line");
    paragraph(f, "Expected:", member_or_empty(c, "expected"), "");
    paragraph(f, "Seen:", member_or_empty(c, "seen"), "");
    paragraph(f, "Decided by staff:", member_or_empty(c, "appeal"), "");
    if (grade_is_provisional(c))
        paragraph(
            f, "Provisional:",
            "the samples did not suffice to decide it; the points are kept until staff have looked.",
            "");
    paragraph(f, "Explained by what you were given, no points lost for it:",
              member_or_empty(c, "accepted"), "");
    paragraph(f, "Paid once:", member_or_empty(c, "carried"), "");
    if (!full) {
        paragraph(f, "Hint:", member_or_empty(c, "hint"), "");
        paragraph(f, "Where:", member_or_empty(c, "where"), "");
    }
    if (judged && member_text(c, "appeal") == NULL)
        show_chance(f, member_number(c, "chance"), share > 0 && share < 1, " here");
    bool ok = !stands_out(p, c) || show_evidence(p, c, e);
    fputs("</section>\n", f);
    return ok;
}

/* The checks that stand out, or the others. */
static bool show_checks(const struct page *p, bool out, struct err *e)
{
    size_t num = 0;
    bool ok = true;
    json_each(c, json_object_get(p->grade, "checks"))
        num += stands_out(p, c) == out;
    if (num == 0)
        return true;
    if (out)
        fprintf(p->f, "<h2>%s</h2>\n",
                p->staff ? "Lost, or for you to look at" : "What to look at");
    else
        fprintf(p->f, "<h2>What is right</h2><details><summary>%zu with all points</summary>\n",
                num);
    json_each(c, json_object_get(p->grade, "checks"))
        if (stands_out(p, c) == out)
            ok = ok && show_check(p, c, e);
    fputs(out ? "" : "</details>\n", p->f);
    return ok;
}

static void show_head(const struct page *p)
{
    FILE *f = p->f;
    const json_t *grade = p->grade;
    char text[2048];
    html_print(f, "<p class=\"kicker\">%s</p>\n<h1>%s: %.2f of %g points</h1>\n",
               member_text(grade, "rubric"), member_text(grade, "id"),
               member_number(grade, "points"), member_number(grade, "of"));
    if (p->staff) {
        fputs(
            "<p><a href=\"index.html\">What the student reads</a>, <a href=\"../index.html\">the class</a></p>\n",
            f);
        if (grade_needs(grade, text, sizeof text))
            paragraph(f, "For you to look at:", text, "error-line");
        grade_change_text(grade, text, sizeof text);
        paragraph(f, "Changed:", text, "");
        return;
    }
    const char *state = grade_state(grade);
    snprintf(text, sizeof text, "Your submission: %s.",
             state != NULL ? state : "something is wrong");
    if (member_text(grade, "trouble") != NULL)
        paragraph(f, "Could not be graded:", member_or_empty(grade, "trouble"), "error-line");
    else if (state != NULL || member_text(grade, "wrong") != NULL)
        html_print(f, "<p class=\"error-line\"><b>%s</b> %s</p>\n", text,
                   member_text(grade, "wrong"));
    if (grade_is_provisional(grade))
        paragraph(
            f, "Provisional:",
            "some checks could not be decided; their points are kept until staff have looked.",
            "error-line");
    if (json_is_object(json_object_get(grade, "before")))
        html_print(f, "<p>Graded anew; it had %.2f of %g.</p>\n",
                   member_number(json_object_get(grade, "before"), "points"),
                   member_number(json_object_get(grade, "before"), "of"));
    if (member_text(grade, "trouble") == NULL && state == NULL &&
        strcmp(member_or_empty(grade, "kind"), "images") != 0)
        show_chance(f, member_number(grade, "chance"),
                    member_number(grade, "chance") >= 1 && !may_change(grade), "");
}

static void fact(FILE *f, const char *what, const char *value)
{
    if (value[0] != '\0')
        html_print(f, "<div><dt>%s</dt><dd>%s</dd></div>\n", what, value);
}

static void show_runs(const struct page *p)
{
    html_table_open(p->f, NULL, "Images", "image|>runs|>CPU, s|>wall, s|size|ended|said");
    json_each(image, json_object_get(p->grade, "pictures")) {
        const char *end = member_or_empty(image, "end"), *why = member_or_empty(image, "why");
        bool ran = member_number(image, "wall_s") > 0;
        html_row_open(p->f, strcmp(end, "ok") != 0 || why[0] != '\0', member_text(image, "name"));
        fprintf(p->f,
                "<td class=\"num\">%.0f</td><td class=\"num\">%.2f</td><td class=\"num\">%.2f</td>",
                json_is_number(json_object_get(image, "runs")) ? member_number(image, "runs") : 1.0,
                member_number(image, "cpu_s"), member_number(image, "wall_s"));
        html_print(p->f, "<td>%.0f × %.0f</td><td>%s</td><td class=\"error-cell\">%s",
                   member_number(image, "width"), member_number(image, "height"), end, why);
        if (ran)
            html_print(p->f, " <a href=\"%s.log\">%s.log</a>", member_text(image, "name"),
                       member_text(image, "name"));
        fputs("</td></tr>\n", p->f);
    }
    html_table_close(p->f);
}

/* The command that grades this one again, into the same directory. */
static bool show_command(const struct page *p, struct err *e)
{
    static const char begin[] = "assay grade ";
    const char *command = member_or_empty(p->grade, "command");
    if (strncmp(command, begin, strlen(begin)) != 0)
        return true;
    char *out = shell_quote_join("-o", (const char *const[]){p->dir, NULL});
    if (out == NULL)
        return err_set(e, "out of memory");
    html_print(p->f, "<pre><code>%s%s %s</code></pre>\n", begin, out, command + strlen(begin));
    free(out);
    return true;
}

/* How it was graded. */
static bool show_facts(const struct page *p, struct err *e)
{
    const json_t *grade = p->grade;
    FILE *f = p->f;
    fputs("<h2>How it was graded</h2>\n<dl class=\"facts\">\n", f);
    fact(f, "kind", member_or_empty(grade, "kind"));
    fact(f, "CPU time", html_duration(member_number(grade, "cpu_s")).s);
    fact(f, "accepted", member_or_empty(grade, "accepted"));
    fact(f, "bug on top of", member_or_empty(json_object_get(grade, "diagnosis"), "with"));
    if (json_array_size(json_object_get(json_object_get(grade, "diagnosis"), "named")) == 0)
        fact(f, "bug", member_or_empty(json_object_get(grade, "diagnosis"), "gate"));
    fact(f, "bug not looked for", member_or_empty(json_object_get(grade, "diagnosis"), "error"));
    fact(f, "sandbox", json_is_false(json_object_get(grade, "sandbox")) ? "none" : "yes");
    fact(f, "seed", html_number(member_number(grade, "seed")).s);
    fact(f, "other points in another run, chance", html_number(member_number(grade, "chance")).s);
    fact(f, "version", member_or_empty(grade, "version"));
    fputs("</dl>\n", f);
    if (!show_command(p, e))
        return false;
    if (json_array_size(json_object_get(grade, "pictures")) > 0)
        show_runs(p);
    return true;
}

static bool page(const struct page *p, struct err *e)
{
    html_page_open(p->f, member_or_empty(p->grade, "id"), NULL, 0);
    fputs("<div class=\"grade\">\n", p->f);
    show_head(p);
    bool built = strcmp(member_or_empty(p->grade, "state"), "not_built") != 0;
    if (!built)
        grade_summary_build_log(p->f, p->dir, p->grade);
    grade_summary_bug(p->f, p->grade);
    bool ok = show_image(p, member_or_empty(p->grade, "located_picture"), NULL, e);
    grade_summary_parts(p->f, p->grade);
    ok = ok && show_checks(p, true, e) && show_checks(p, false, e);
    if (p->left_out)
        fputs("<p>Some checks are not shown yet: nothing on this page counts them.</p>\n", p->f);
    ok = ok && (!p->staff || show_facts(p, e));
    if (built)
        grade_summary_build_log(p->f, p->dir, p->grade);
    fputs("</div>\n", p->f);
    html_page_close(p->f);
    return ok;
}

/* ---- what a student may see */

bool student_view_shows(const json_t *check)
{
    return strcmp(member_or_empty(check, "visibility"), "visible") == 0;
}

/* Does the text name a mistake that the student is told anyway? */
static bool is_told(const char *text, const json_t *diagnosis)
{
    json_each(b, json_object_get(diagnosis, "named"))
        if (member_text(b, "bug") != NULL && strstr(text, member_text(b, "bug")) != NULL)
            return true;
    return false;
}

/* The checks that are shown. What one of them has been spared may be known from another that is not. */
static json_t *shown_checks(const json_t *grade, const json_t *diagnosis)
{
    static const char paid[] = "held against images with a mistake that another check pays for";
    json_t *shown = json_array();
    bool lost = false;
    json_each(c, json_object_get(grade, "checks"))
        lost = lost || (!student_view_shows(c) && !grade_is_full(c));
    json_each(c, json_object_get(grade, "checks")) {
        const char *carried = member_or_empty(c, "carried");
        if (!student_view_shows(c))
            continue;
        json_t *copy = json_copy(c);
        if (lost && carried[0] != '\0' && !is_told(carried, diagnosis))
            json_object_set_new(copy, "carried", json_string(paid));
        json_array_append_new(shown, copy);
    }
    return shown;
}

/* Points, chance and so on of all checks, or of those of one part (NULL: of all). */
static double sum_of(const json_t *checks, const char *part, const char *what)
{
    double sum = 0;
    json_each(c, checks)
        if (part == NULL || strcmp(member_or_empty(c, "part"), part) == 0)
            sum += member_number(c, what);
    return sum;
}

static json_t *shown_parts(const json_t *grade, const json_t *checks)
{
    json_t *parts = json_array();
    json_each(p, json_object_get(grade, "parts")) {
        const char *number = member_or_empty(p, "number");
        bool any = false;
        json_each(c, checks)
            any = any || strcmp(member_or_empty(c, "part"), number) == 0;
        if (any)
            json_array_append_new(parts, json_pack("{ss, ss, sf, sf}", "number", number, "title",
                                                   member_or_empty(p, "title"), "points",
                                                   sum_of(checks, number, "points"), "of",
                                                   sum_of(checks, number, "of")));
    }
    return parts;
}

json_t *student_view(const json_t *grade)
{
    static const char *const about_mistake[] = {"diagnosis", "located", "located_picture"};
    json_t *view = json_copy((json_t *)grade);
    bool all = true;
    json_each(c, json_object_get(grade, "checks"))
        all = all && student_view_shows(c);
    if (all)
        return view;
    const json_t *told = json_object_get(grade, "for_student");
    for (size_t k = 0; k < sizeof about_mistake / sizeof *about_mistake; k++) {
        json_object_del(view, about_mistake[k]);
        json_object_set(view, about_mistake[k], json_object_get(told, about_mistake[k]));
    }
    json_t *checks = shown_checks(grade, json_object_get(told, "diagnosis"));
    json_object_set_new(view, "parts", shown_parts(grade, checks));
    json_object_set_new(view, "points", json_real(sum_of(checks, NULL, "points")));
    json_object_set_new(view, "of", json_real(sum_of(checks, NULL, "of")));
    json_object_set_new(view, "chance", json_real(fmin(1, sum_of(checks, NULL, "chance"))));
    json_object_set_new(view, "checks", checks);
    json_object_del(view, "provisional");
    json_object_del(view, "before"); /* of all checks */
    return view;
}

bool student_page(FILE *f, const char *dir, const json_t *view, bool left_out, struct err *e)
{
    return page(&(struct page){.f = f, .dir = dir, .grade = view, .left_out = left_out}, e);
}

bool student_page_for_staff(FILE *f, const char *dir, const struct rubric *r,
                            const struct answer_key *a, const json_t *grade, struct err *e)
{
    return page(&(struct page){f, dir, grade, true, r, a, false}, e);
}
