/* Timestamps as written into files. */
#ifndef ASSAY_UTC_DATE_H
#define ASSAY_UTC_DATE_H

/* "2026-11-23T04:42:12Z" [ISO 8601]: now, in UTC. */
struct utc_date {
    char s[32];
} utc_date_now(void);

#endif
