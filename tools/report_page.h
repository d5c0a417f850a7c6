/* The page's style sheet and script, as they stand in page.css and page*.js, inside the program. */
#ifndef ASSAY_REPORT_PAGE_H
#define ASSAY_REPORT_PAGE_H

extern const char page_css[]; /* NUL-terminated */
extern const char page_js[];

#endif
