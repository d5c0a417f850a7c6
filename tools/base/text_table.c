#include "text_table.h"

#include <string.h>

size_t text_table_width(const char *s)
{
    size_t n = 0;
    for (; *s != '\0'; s++)
        n += ((unsigned char)*s & 0xc0) != 0x80;
    return n;
}

/* Row 0 has the headings. */
static const char *text_of(const struct text_table *t, size_t row, size_t column, bool markdown,
                           char buffer[TEXT_TABLE_CELL])
{
    return row == 0 ? t->column[column].heading : t->cell(t->of, row - 1, column, markdown, buffer);
}

static void print_aligned(FILE *f, const struct text_table *t)
{
    char buffer[TEXT_TABLE_CELL];
    size_t width[TEXT_TABLE_COLUMNS] = {0};
    for (size_t row = 0; row <= t->num_rows; row++)
        for (size_t c = 0; c < t->num_columns; c++) {
            size_t w = text_table_width(text_of(t, row, c, false, buffer));
            width[c] = w > width[c] ? w : width[c];
        }
    for (size_t row = 0; row <= t->num_rows; row++) {
        for (size_t c = 0; c < t->num_columns; c++) {
            const char *text = text_of(t, row, c, false, buffer);
            int gap = (int)(width[c] - text_table_width(text));
            bool right = t->column[c].is_number, is_last = c + 1 == t->num_columns;
            fprintf(f, "%*s%s%*s%s", right ? gap : 0, "", text, right || is_last ? 0 : gap, "",
                    is_last ? "\n" : "  ");
        }
    }
}

void text_table_escape(FILE *f, const char *text)
{
    for (; *text != '\0'; text++) {
        if (*text == '\n' || *text == '\r')
            fputc(' ', f);
        else if (*text == '<')
            fputs("&lt;", f);
        else if (*text == '&')
            fputs("&amp;", f);
        else if (strchr("|\\`*_[]", *text) != NULL)
            fprintf(f, "\\%c", *text);
        else
            fputc(*text, f);
    }
}

static void print_markdown(FILE *f, const struct text_table *t)
{
    char buffer[TEXT_TABLE_CELL];
    for (size_t row = 0; row <= t->num_rows; row++) {
        for (size_t c = 0; c < t->num_columns; c++) {
            const char *text = text_of(t, row, c, true, buffer);
            fputs("| ", f);
            if (row > 0 && t->column[c].is_foreign)
                text_table_escape(f, text);
            else
                fputs(text, f);
            fputc(' ', f);
        }
        fputs("|\n", f);
        for (size_t c = 0; row == 0 && c < t->num_columns; c++)
            fprintf(f, "%s%s", t->column[c].is_number ? "|--:" : "|---",
                    c + 1 == t->num_columns ? "|\n" : "");
    }
}

void text_table_print(FILE *f, const struct text_table *t, bool markdown)
{
    if (markdown)
        print_markdown(f, t);
    else
        print_aligned(f, t);
}
