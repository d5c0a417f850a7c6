/* Drives Blender: one process for all replicates that are asked for. */
#ifndef ASSAY_CYCLES_DRIVER_H
#define ASSAY_CYCLES_DRIVER_H

#include "reference/replicates/engine_driver.h"

extern const struct engine_driver cycles_driver;

#endif
