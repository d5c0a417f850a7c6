#include "shell_quote.h"

#include <stdlib.h>
#include <string.h>

/* Writes one word to `to`, which has room for it, quoted where a shell needs it; returns its end. */
static char *append(char *to, const char *word)
{
    static const char safe[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                               "-_./:=,+%@";
    if (word[0] != '\0' && strspn(word, safe) == strlen(word))
        return stpcpy(to, word);
    *to++ = '\'';
    for (; *word != '\0'; word++)
        if (*word == '\'')
            to = stpcpy(to, "'\\''");
        else
            *to++ = *word;
    return stpcpy(to, "'");
}

char *shell_quote_join(const char *first, const char *const *word)
{
    enum { WORST = 4, AROUND = 3 }; /* '\'' for each quote; two quotes and a blank */
    size_t size = 1 + (first != NULL ? WORST * strlen(first) + AROUND : 0);
    for (int i = 0; word[i] != NULL; i++)
        size += WORST * strlen(word[i]) + AROUND;
    char *text = malloc(size), *end = text;
    if (text == NULL)
        return NULL;
    *end = '\0';
    if (first != NULL)
        end = append(end, first);
    for (; *word != NULL; word++) {
        if (end > text)
            *end++ = ' ';
        end = append(end, *word);
    }
    return text;
}

/* Unquotes the word at *text to *to, with a terminating zero, and advances both; false if it is not accepted. */
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

char **shell_quote_split(const char *text, int *num, struct err *e)
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
