/* The page of the class, for staff: which submissions need them, what changed, points of each,
 * their distribution, common bugs, slow programs, the same images and the same noise. */
#include "student_page.h"

#include "grade_change.h"
#include "grade_needs.h"
#include "tools/html/html.h"
#include "tools/plots/plot.h"
#include "tools/results/results.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { BARS = 20, SLOWEST = 5 };

static void histogram(FILE *f, const json_t *grades)
{
    double count[BARS] = {0}, most = 1;
    json_each(g, grades) {
        double share = member_number(g, "points") / fmax(1e-9, member_number(g, "of"));
        int bar = (int)(share * BARS);
        count[bar < BARS ? bar : BARS - 1]++;
    }
    for (int b = 0; b < BARS; b++)
        most = fmax(most, count[b]);
    struct plot p = plot_sized(f, 400, 100);
    p.x = (struct plot_axis){.label = "points, %", .hi = 100};
    p.y = (struct plot_axis){.label = "submissions", .hi = 1.1 * most, .step = most < 5 ? 1 : 0};
    fputs("<h2>Points</h2>", f);
    plot_open(&p, "How many submissions have how many points");
    for (int b = 0; b < BARS; b++)
        if (count[b] > 0)
            plot_bar(&p, "bar", 100.0 * b / BARS + 0.25, 0, 100.0 * (b + 1) / BARS - 0.25, count[b],
                     "%d to %d %%: %g", 100 * b / BARS, 100 * (b + 1) / BARS, count[b]);
    plot_close(&p);
}

/* A link to ID/FILE, the id percent-encoded. */
static void link_to(FILE *f, const char *id, const char *file, const char *text)
{
    fputs("<a href=\"", f);
    for (const char *c = id; *c != '\0'; c++)
        if (strchr("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-", *c) != NULL)
            fputc(*c, f);
        else
            fprintf(f, "%%%02X", (unsigned)(unsigned char)*c);
    html_print(f, "/%s\">%s</a>", file, text);
}

static void link_to_staff(FILE *f, const json_t *grade)
{
    link_to(f, member_or_empty(grade, "id"), "staff.html", member_or_empty(grade, "id"));
}

/* Those that need staff first, then those with the fewest points. */
static int by_urgency(const void *a, const void *b)
{
    const json_t *g = *(json_t *const *)a, *h = *(json_t *const *)b;
    char ignored[8];
    int needs = grade_needs(h, ignored, sizeof ignored) - grade_needs(g, ignored, sizeof ignored);
    double x = member_number(g, "points"), y = member_number(h, "points");
    if (needs != 0)
        return needs;
    return x != y ? (x > y) - (x < y) : strcmp(member_or_empty(g, "id"), member_or_empty(h, "id"));
}

/* Why a submission needs staff, in a word or two. */
static const char *in_short(const json_t *grade)
{
    const char *state = grade_state(grade);
    return state != NULL ? state : grade_is_provisional(grade) ? "provisional" : "look";
}

/* The line on top: who needs staff. */
static void summary(FILE *f, json_t *const *sorted, size_t num)
{
    enum { NAMED = 12 };
    char text[8];
    size_t needed = 0;
    while (needed < num && grade_needs(sorted[needed], text, sizeof text))
        needed++;
    if (needed > 0)
        fprintf(f, "<p class=\"error-line\"><b>%zu of %zu need you</b>", needed, num);
    else
        fprintf(f, "<p><b>None of %zu needs you</b>", num);
    for (size_t i = 0; i < needed && i < NAMED; i++) {
        fputs(i == 0 ? ": " : ", ", f);
        link_to_staff(f, sorted[i]);
        html_print(f, " (%s)", in_short(sorted[i]));
    }
    if (needed > NAMED)
        fprintf(f, " and %zu more", needed - NAMED);
    fputs(".</p>\n", f);
}

static void bugs_of(FILE *f, const json_t *g)
{
    size_t k;
    json_t *b;
    json_array_foreach(json_object_get(json_object_get(g, "diagnosis"), "named"), k, b) {
        const char *and = member_or_empty(b, "and_bug");
        html_print(f, "%s%s%s%s", k > 0 ? "; or " : "", member_text(b, "bug"),
                   and[0] != '\0' ? ", and " : "", and);
    }
    /* Deviations other than those it was graded with: staff may want to know. */
    const char *with = member_or_empty(json_object_get(g, "diagnosis"), "with");
    if (k > 0 && with[0] != '\0' && strcmp(with, member_or_empty(g, "accepted")) != 0)
        html_print(f, " on top of %s", with);
    const char *between = "";
    if (k == 0 && member_text(g, "located") != NULL) {
        html_text(f, member_text(g, "located"));
        between = "; ";
    }
    json_each(part, json_object_get(json_object_get(g, "diagnosis"), "parts")) {
        html_print(f, "%sPart %s: ", between, member_text(part, "part"));
        between = "; ";
        json_array_foreach(json_object_get(part, "named"), k, b)
            html_print(f, "%s%s", k > 0 ? " or " : "", member_text(b, "bug"));
    }
}

static void row(FILE *f, const json_t *g, size_t parts)
{
    char text[2048];
    const char *accepted = member_or_empty(g, "accepted");
    bool needs = grade_needs(g, text, sizeof text);
    fprintf(f, "<tr%s><th scope=\"row\">", needs ? " class=\"bad\"" : "");
    link_to_staff(f, g);
    fputs("<br><small>", f);
    link_to(f, member_or_empty(g, "id"), "index.html", "student's page");
    fprintf(f, "</small></th><td class=\"num\">%.2f</td><td class=\"needs\">",
            member_number(g, "points"));
    if (needs)
        html_print(f, "<span class=\"badge error\">%s</span> %s", in_short(g), text);
    if (accepted[0] != '\0')
        html_print(f, "%saccepted: %s", needs ? "; " : "", accepted);
    fputs("</td><td class=\"needs\">", f);
    bugs_of(f, g);
    fputs("</td>", f);
    json_each(p, json_object_get(g, "parts"))
        fprintf(f, "<td class=\"num\">%.2f</td>", member_number(p, "points"));
    for (size_t k = json_array_size(json_object_get(g, "parts")); k < parts; k++)
        fputs("<td></td>", f);
    fputs("</tr>\n", f);
}

static void table(FILE *f, json_t *const *sorted, size_t num)
{
    const json_t *parts = NULL;
    for (size_t i = 0; i < num; i++)
        if (json_array_size(json_object_get(sorted[i], "parts")) > json_array_size(parts))
            parts = json_object_get(sorted[i], "parts");
    fputs(
        "<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"Submissions\"><table><thead><tr>"
        "<th scope=\"col\">submission</th><th scope=\"col\" class=\"num\">points</th>"
        "<th scope=\"col\">for you to look at</th><th scope=\"col\">what is wrong</th>",
        f);
    json_each(p, parts) {
        html_print(f, "<th scope=\"col\" class=\"num\" title=\"%s\">Part&nbsp;%s</th>",
                   member_text(p, "title"), member_text(p, "number"));
    }
    fputs("</tr></thead>\n<tbody>\n", f);
    for (size_t i = 0; i < num; i++)
        row(f, sorted[i], json_array_size(parts));
    html_table_close(f);
}

/* What changed since the grades before, by another rubric or an appeal. */
static void changes(FILE *f, json_t *const *sorted, size_t num)
{
    size_t changed = 0;
    for (size_t i = 0; i < num; i++) {
        char text[1024];
        grade_change_text(sorted[i], text, sizeof text);
        if (text[0] == '\0')
            continue;
        if (changed++ == 0)
            fputs("<h2>What changed</h2><ul>\n", f);
        fputs("<li>", f);
        link_to_staff(f, sorted[i]);
        fprintf(f, ": %.2f of %g, ", member_number(sorted[i], "points"),
                member_number(sorted[i], "of"));
        html_print(f, "%s</li>\n", text);
    }
    fputs(changed > 0 ? "</ul>\n" : "", f);
}

/* A text and how often it was met. */
struct tally {
    const char *text;
    double num;
    const json_t *grade;
};

static int by_num(const void *a, const void *b)
{
    const struct tally *x = a, *y = b;
    return (x->num < y->num) - (x->num > y->num);
}

static size_t count_one(struct tally *t, size_t num, const char *text)
{
    for (size_t i = 0; i < num; i++)
        if (strcmp(t[i].text, text) == 0) {
            t[i].num++;
            return num;
        }
    t[num] = (struct tally){.text = text, .num = 1};
    return num + 1;
}

static void common_bugs(FILE *f, const json_t *grades, struct tally *t)
{
    size_t num = 0;
    json_each(g, grades) {
        const json_t *first =
            json_array_get(json_object_get(json_object_get(g, "diagnosis"), "named"), 0);
        if (first != NULL)
            num = count_one(t, num, member_or_empty(first, "bug"));
    }
    if (num == 0)
        return;
    qsort(t, num, sizeof *t, by_num);
    fputs("<h2>Most common bugs</h2><table>\n", f);
    for (size_t i = 0; i < num && i < 10; i++)
        html_print(f, "<tr><td class=\"num\">%g</td><td>%s</td></tr>\n", t[i].num, t[i].text);
    fputs("</table>\n", f);
}

/* How many of its images were not made because the program did not end. */
static int without_end(const json_t *grade)
{
    int num = 0;
    json_each(p, json_object_get(grade, "pictures"))
        num += strcmp(member_or_empty(p, "end"), "wall time") == 0 ||
               strcmp(member_or_empty(p, "end"), "processor time") == 0;
    return num;
}

static void slowest(FILE *f, const json_t *grades, struct tally *t)
{
    size_t num = 0;
    json_each(g, grades)
        t[num++] = (struct tally){member_or_empty(g, "id"), member_number(g, "cpu_s"), g};
    qsort(t, num, sizeof *t, by_num);
    fputs("<h2>Slowest</h2><table>\n", f);
    for (size_t i = 0; i < num && i < SLOWEST; i++) {
        const int lost = without_end(t[i].grade);
        html_print(f, "<tr><td class=\"num\">%s%.1f s</td><td>%s</td></tr>\n",
                   lost > 0 ? "more than " : "", t[i].num, t[i].text);
    }
    fputs("</table>\n", f);
}

/* Have both all images in common, two at least, bit by bit? */
static bool same_images(const json_t *g, const json_t *h)
{
    size_t m, same = 0, num = 0;
    json_t *p;
    json_array_foreach(json_object_get(g, "pictures"), m, p) {
        const char *a = member_or_empty(p, "sha256"),
                   *b =
                       member_or_empty(json_array_get(json_object_get(h, "pictures"), m), "sha256");
        num += a[0] != '\0';
        same += a[0] != '\0' && strcmp(a, b) == 0;
    }
    return num >= 2 && same == num;
}

/* Submissions that share their images, a line for all that have the same. A program without a seed of its own always
 * makes the same one, and two that follow the text to the letter may make the same: no proof of anything. */
static void look_alikes(FILE *f, const json_t *grades)
{
    const size_t num = json_array_size(grades);
    bool any = false;
    for (size_t i = 0; i < num; i++) {
        const json_t *g = json_array_get(grades, i);
        bool told = false, more = false;
        for (size_t k = 0; k < i && !told; k++)
            told = same_images(json_array_get(grades, k), g);
        for (size_t k = i + 1; k < num && !told; k++) {
            const json_t *h = json_array_get(grades, k);
            if (!same_images(g, h))
                continue;
            if (!any)
                fputs(
                    "<h2>All images the same, bit by bit</h2><p>No proof of anything: programs with a fixed seed that do the same "
                    "make the same.</p><ul>\n",
                    f);
            any = true;
            if (!more)
                html_print(f, "<li>%s", member_text(g, "id"));
            more = true;
            html_print(f, ", %s", member_text(h, "id"));
        }
        fputs(more ? "</li>\n" : "", f);
    }
    fputs(any ? "</ul>\n" : "", f);
}

/* Puts i, all that are alike to it, and so on, into the group `number`. group[k]: group of k from 1
 * on; 0: not yet seen. */
static void join_group(const json_t *grades, size_t i, int number, int *group)
{
    size_t m;
    json_t *other;
    group[i] = number;
    json_each(like, json_object_get(json_array_get(grades, i), "alike")) {
        json_array_foreach(grades, m, other)
            if (group[m] == 0 &&
                strcmp(member_or_empty(other, "id"), member_or_empty(like, "id")) == 0)
                join_group(grades, m, number, group);
    }
}

static void list_group(FILE *f, const json_t *grades, int number, const int *group)
{
    enum { HANDOUT = 4 }; /* who copy are fewer */
    size_t i, members = 0, all = 0;
    json_t *g;
    for (i = 0; i < json_array_size(grades); i++)
        all += group[i] == number;
    fputs("<li>", f);
    if (all >= HANDOUT && 4 * all >= json_array_size(grades))
        fprintf(
            f,
            "%zu of %zu, so many that it is probably the generator of random numbers that all were given: ",
            all, json_array_size(grades));
    json_array_foreach(grades, i, g) {
        if (group[i] != number)
            continue;
        fputs(members++ > 0 ? ", " : "", f);
        link_to_staff(f, g);
    }
    fputs("</li>\n", f);
}

/* same_noise.h: who has the noise of the reference. */
static void show_copies(FILE *f, const json_t *grades)
{
    bool any = false;
    json_each(g, grades) {
        const json_t *first = json_array_get(json_object_get(g, "copied"), 0);
        if (first == NULL)
            continue;
        if (!any)
            fputs(
                "<h2>The noise of the reference</h2><p>Images in which the reference's own errors are found, with or without other "
                "noise on top: a program that draws its own numbers has them once in a thousand classes. Look at where these "
                "images come from.</p><ul>\n",
                f);
        any = true;
        fputs("<li>", f);
        link_to_staff(f, g);
        html_print(f, ": %s</li>\n",
                   member_text(first, "picture") != NULL ? member_text(first, "picture")
                                                         : "all images together");
    }
    fputs(any ? "</ul>\n" : "", f);
}

/* same_noise.h: which submissions have the same noise, in groups. */
static void show_same_noise(FILE *f, const json_t *grades, int *group)
{
    int number = 0;
    size_t i;
    json_t *g;
    json_array_foreach(grades, i, g) {
        if (group[i] > 0 || json_array_size(json_object_get(g, "alike")) == 0)
            continue;
        if (number == 0)
            fputs(
                "<h2>The same noise</h2><p>Images that cost no points and whose errors go together more than those of programs "
                "that draw numbers of their own: one false alarm in a thousand classes. No proof of anything: the same fixed seed in "
                "what all were given does it too. Each line is a chain of likenesses.</p><ul>\n",
                f);
        join_group(grades, i, ++number, group);
        list_group(f, grades, number, group);
    }
    fputs(number > 0 ? "</ul>\n" : "", f);
}

bool class_page(FILE *f, const json_t *grades, struct err *e)
{
    size_t num = json_array_size(grades);
    json_t **sorted = calloc(num + 1, sizeof(json_t *));
    struct tally *t = calloc(num + 1, sizeof *t);
    int *group = calloc(num + 1, sizeof *group);
    bool ok = (sorted != NULL && t != NULL && group != NULL) ||
              err_set(e, "out of memory for the page of the class");
    if (ok) {
        for (size_t i = 0; i < num; i++)
            sorted[i] = json_array_get(grades, i);
        qsort(sorted, num, sizeof(json_t *), by_urgency);
        html_page_open(f, "Grades", NULL, 0);
        html_print(f, "<div class=\"grade\">\n<h1>%s</h1>\n",
                   member_text(json_array_get(grades, 0), "rubric"));
        if (json_object_get(json_array_get(grades, 0), "variant") != NULL)
            html_print(f, "<p>Variant %g of the rubric's scenes was drawn for this class.</p>\n",
                       member_number(json_array_get(grades, 0), "variant"));
        summary(f, sorted, num);
        changes(f, sorted, num);
        table(f, sorted, num);
        histogram(f, grades);
        common_bugs(f, grades, t);
        slowest(f, grades, t);
        look_alikes(f, grades);
        show_copies(f, grades);
        show_same_noise(f, grades, group);
        fputs("</div>\n", f);
        html_page_close(f);
    }
    free(sorted);
    free(t);
    free(group);
    return ok;
}
