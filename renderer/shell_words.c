#include "shell_words.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool shell_append(char *text, size_t size, const char *word)
{
    static const char safe[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                               "-_./:=,+%@";
    size_t n = strlen(text), quotes = 0;
    const char *quote = word[0] != '\0' && strspn(word, safe) == strlen(word) ? "" : "'";
    for (const char *c = word; *c != '\0'; c++)
        quotes += *c == '\'';
    if (n + 1 + 2 * strlen(quote) + strlen(word) + 3 * quotes + 1 > size)
        return false;
    n += (size_t)snprintf(text + n, size - n, "%s%s", n > 0 ? " " : "", quote);
    for (; *word != '\0'; word++)
        n += (size_t)snprintf(text + n, size - n, *word == '\'' ? "'\\''" : "%c", *word);
    snprintf(text + n, size - n, "%s", quote);
    return true;
}

void shell_append_all(char *text, size_t size, const char *const *word)
{
    while (*word != NULL && shell_append(text, size, *word))
        word++;
}

/* One word from *text on, unquoted to *to with its zero; false on what is not accepted. */
static bool take_word(const char **text, char **to)
{
    const char *c = *text;
    while (*c != '\0' && *c != ' ') {
        if (*c == '\'') {
            const char *end = strchr(c + 1, '\'');
            if (end == NULL)
                return false;
            memcpy(*to, c + 1, (size_t)(end - c - 1));
            *to += end - c - 1;
            c = end + 1;
        } else if (*c == '\\' && c[1] != '\0') {
            *(*to)++ = c[1];
            c += 2;
        } else if (strchr("\\\"$`|&;<>()*?[]#~\t\n", *c) != NULL) {
            return false;
        } else {
            *(*to)++ = *c++;
        }
    }
    *(*to)++ = '\0';
    *text = c;
    return true;
}

char **shell_split(const char *text, int *num, struct err *e)
{
    size_t length = strlen(text), most = length / 2 + 2;
    char **word = malloc(most * sizeof *word + length + 2);
    if (word == NULL) {
        err_set(e, "out of memory");
        return NULL;
    }
    char *to = (char *)(word + most);
    *num = 0;
    for (const char *c = text; *(c += strspn(c, " ")) != '\0';) {
        word[(*num)++] = to;
        if (!take_word(&c, &to)) {
            free(word);
            err_set(e, "not a plain command: '%.200s'", text);
            return NULL;
        }
    }
    word[*num] = NULL;
    return word;
}
