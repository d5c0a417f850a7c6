/* What this build is: "0.1 (commit 1a2b3c4d5e6f)". Set by the Makefile. */
#ifndef ASSAY_VERSION_H
#define ASSAY_VERSION_H

extern const char assay_version[];

#endif
