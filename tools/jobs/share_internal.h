/* What merge.c and share.c have in common. */
#ifndef ASSAY_SHARE_INTERNAL_H
#define ASSAY_SHARE_INTERNAL_H

#include <stdint.h>

enum { NUM_COMMON = 5 };
/* Attributes that shares have to agree on, and what to call them in messages. */
extern const char *const share_common[NUM_COMMON][2];

/* Channel name of one of the PART_VALUES in an image that keeps several parts: "0:4.M2.R". */
void share_part_name(uint32_t first, uint32_t last, int value, char name[64]);

#endif
