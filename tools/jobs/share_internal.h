/* What merge.c and share.c have in common. */
#ifndef ASSAY_SHARE_INTERNAL_H
#define ASSAY_SHARE_INTERNAL_H

#include <stdint.h>

enum { NUM_COMMON = 5 };
/* What shares have to agree on, by metadata, and what that is to a reader. */
extern const char *const share_common[NUM_COMMON][2];

/* The channel of one of PART_VALUES, by its name among those of several parts: "0:4.M2.R". */
void share_part_name(uint32_t first, uint32_t last, int value, char name[64]);

#endif
