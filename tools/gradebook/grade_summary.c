/* What the pages of student and staff have in common: the named bug, points by part, the
 * build's log. */
#include "student_page.h"

#include "grade_needs.h"
#include "reference/base/json_node.h"
#include "renderer/base/fs.h"
#include "tools/html/html.h"

#include <string.h>

/* "Part 4 by itself looks like ...". */
static void parts_by_themselves(FILE *f, const json_t *diagnosis)
{
    json_each(part, json_object_get(diagnosis, "parts")) {
        const char *between = " by itself looks like";
        html_print(f, "<p>Part %s", member_text(part, "part"));
        json_each(b, json_object_get(part, "named")) {
            html_print(f, "%s <b>%s</b> <span class=\"where\">(%s)</span>", between,
                       member_text(b, "bug"), member_text(b, "where"));
            between = ", or";
        }
        fputs(".</p>\n", f);
    }
}

/* The named bug with what it is called where, or where what is wrong shows. */
void grade_summary_bug(FILE *f, const json_t *grade)
{
    const json_t *diagnosis = json_object_get(grade, "diagnosis"),
                 *named = json_object_get(diagnosis, "named");
    const char *located = member_or_empty(grade, "located");
    const bool unknown =
        grade_differs(grade) && strcmp(member_or_empty(diagnosis, "finding"), "unknown") == 0;
    if (json_array_size(named) > 0) {
        fprintf(f, "<div class=\"finding\"><p>This looks like %s:</p><ul>\n",
                json_array_size(named) > 1 ? "one of these, which these images cannot tell apart"
                                           : "a known mistake");
        json_each(b, named) {
            html_print(f, "<li><b>%s</b> <span class=\"where\">(%s)</span>", member_text(b, "bug"),
                       member_text(b, "where"));
            if (member_text(b, "and_bug") != NULL)
                html_print(f, ", and with it <b>%s</b> <span class=\"where\">(%s)</span>",
                           member_text(b, "and_bug"), member_text(b, "and_where"));
            if (json_is_number(json_object_get(b, "explained")))
                fprintf(f, "; explains %.3g %% of what differs",
                        100 * member_number(b, "explained"));
            fputs("</li>\n", f);
        }
        fputs("</ul>\n", f);
        if (located[0] != '\0')
            html_print(f, "<p>It shows <b>%s</b>.</p>\n", located);
        fputs("</div>\n", f);
    } else if (located[0] != '\0' || unknown ||
               json_array_size(json_object_get(diagnosis, "parts")) > 0) {
        fputs("<div class=\"finding\">", f);
        const bool looked = json_object_get(diagnosis, "finding") != NULL;
        if (located[0] != '\0')
            html_print(f, "<p>%s <b>%s</b>.</p>\n",
                       looked ? "No known mistake explains all of it. It shows"
                              : "What is wrong shows",
                       located);
        else if (unknown)
            fputs(
                "<p>The images differ from the right ones in a way that no known mistake explains.</p>\n",
                f);
        parts_by_themselves(f, diagnosis);
        fputs("</div>\n", f);
    }
}

/* The checks of a part that lost points, as links. */
static void list_losses(FILE *f, const json_t *grade, const char *part)
{
    json_each(c, json_object_get(grade, "checks")) {
        double lost = member_number(c, "of") - member_number(c, "points");
        if (strcmp(member_or_empty(c, "part"), part) == 0 && lost >= 0.005)
            html_print(
                f,
                "<span class=\"loss\"><span class=\"lost\">−%.2f</span> <a href=\"#check-%s\">%s</a></span>",
                lost, member_text(c, "name"), member_text(c, "title"));
    }
}

/* A bar for each part, as long as it is worth. */
void grade_summary_parts(FILE *f, const json_t *grade)
{
    const json_t *parts = json_object_get(grade, "parts");
    double most = 1e-9;
    json_each(part, parts)
        if (member_number(part, "of") > most)
            most = member_number(part, "of");
    if (json_array_size(parts) == 0)
        return;
    fputs(
        "<table class=\"parts\"><caption>Where the points went</caption>\n"
        "<thead><tr><th scope=\"col\">Part</th><th scope=\"col\" class=\"num\">Points</th></tr></thead><tbody>\n",
        f);
    json_each(part, parts) {
        double of = member_number(part, "of"), points = member_number(part, "points");
        html_print(f, "<tr><th scope=\"row\">%s %s", member_text(part, "number"),
                   member_text(part, "title"));
        fprintf(f,
                "<span class=\"worth\" aria-hidden=\"true\" style=\"width:%.1f%%\">"
                "<span style=\"width:%.1f%%\"></span></span>",
                100 * of / most, of > 0 ? 100 * points / of : 100);
        list_losses(f, grade, member_or_empty(part, "number"));
        fprintf(f, "</th><td class=\"num\">%.2f of %g</td></tr>\n", points, of);
    }
    fputs("</tbody></table>\n", f);
}

/* The last 8 KiB of the build's log, unfolded if the build failed. */
void grade_summary_build_log(FILE *f, const char *dir, const json_t *grade)
{
    enum { SHOWN = 8192 };
    char text[SHOWN + 1];
    const char *name = member_or_empty(grade, "build_log");
    const struct path path = fs_path("%s/%s/%s", dir, member_or_empty(grade, "id"), name);
    FILE *log = name[0] != '\0' ? fopen(path.s, "rb") : NULL;
    if (log == NULL)
        return;
    bool ok = fseek(log, -SHOWN, SEEK_END) == 0 || fseek(log, 0, SEEK_SET) == 0;
    text[ok ? fread(text, 1, SHOWN, log) : 0] = '\0';
    fclose(log);
    fprintf(f, "<details%s><summary>What building it said</summary><pre>",
            strcmp(member_or_empty(grade, "state"), "not_built") == 0 ? " open" : "");
    for (char *line = text, *end; *line != '\0'; line = end) {
        end = line + strcspn(line, "\n");
        bool ends = *end != '\0';
        *end = '\0';
        html_text(f, line);
        fputs(ends ? "\n" : "", f);
        end += ends;
    }
    fputs("</pre></details>\n", f);
}
