/* What a PNG says of its origin: as an EXR does, but the same for the same picture, whatever it is called, whoever renders it on how many
 * threads or in how many jobs, so that equal pictures are equal files. */
#ifndef ASSAY_PNG_METADATA_H
#define ASSAY_PNG_METADATA_H

#include "output.h"

enum picture_kind { PICTURE_IMAGE, PICTURE_RATES, PICTURE_HEATMAP };
/* "image", "rates", "heatmap": the text assay:picture. NULL-terminated. */
extern const char *const png_metadata_kind_names[];

/* The texts of one PNG; those of the output and its identity have to live as long. */
enum { PNG_METADATA_TEXTS = 10 };
struct png_metadata {
    char *command;
    char samples[64], most[16];
    struct image_attr attr[PNG_METADATA_TEXTS];
    int num;
};

/* assay:version, assay:picture, assay:scene, assay:settings, assay:cell and assay:command: the words without those that say how
 * far (-s only with a pilot, as the most that it grants), where to and how. Of an image and of rates also assay:adaptive, assay:seed
 * and assay:samples, "A:B", num_samples of them. Of an image also
 * assay:ranges where sums of ranges were added. Of rates assay:most, the number of samples that is red.
 * False out of memory; else to be freed. */
bool png_metadata_make(const struct output *o, enum picture_kind kind, uint32_t num_samples,
                       struct png_metadata *t) __attribute__((warn_unused_result));
void png_metadata_free(struct png_metadata *t);

#endif
