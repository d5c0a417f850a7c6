/* What had to be assumed about an input, a line each, for the verdict. */
#include "input_internal.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

void input_notes_add(struct notes *notes, const char *format, ...)
{
    int most = (int)(sizeof notes->line / sizeof notes->line[0]);
    if (notes->num == most)
        return;
    char *line = notes->line[notes->num];
    va_list args;
    va_start(args, format);
    vsnprintf(line, sizeof notes->line[0], format, args);
    va_end(args);
    for (int i = 0; i < notes->num; i++)
        if (strcmp(notes->line[i], line) == 0)
            return;
    notes->num++;
}

void input_note_crop(struct notes *notes, const char *path, const struct image_info *info)
{
    if (info->is_cropped)
        input_notes_add(
            notes,
            "%s: stores %d x %d pixels at %d,%d of an image of %d x %d; the rest of it is "
            "0, as OpenEXR has it",
            path, info->data_width, info->data_height, info->data_x, info->data_y, info->width,
            info->height);
}
