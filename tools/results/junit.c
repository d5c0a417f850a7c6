/* Writes results as JUnit XML, a test case for each claim. */
#include "noise_results.h"

#include "reference/base/xml_errors.h"
#include "tools/compare/region.h"
#include "renderer/base/fs.h"

#include <stdlib.h>
#include <string.h>

#include <libxml/xmlwriter.h>

/* A copy in which the control characters that XML 1.0 cannot hold, not even escaped, are '?'. An
 * engine's last words may well contain them. NULL only out of memory. */
static char *xml_text(const char *s)
{
    char *copy = strdup(s != NULL ? s : "");
    if (copy == NULL)
        return NULL;
    for (char *c = copy; *c != '\0'; c++) {
        unsigned char u = (unsigned char)*c;
        if ((u < 0x20 && u != '\t' && u != '\n' && u != '\r') || u == 0x7f)
            *c = '?';
    }
    /* U+FFFE and U+FFFF, UTF-8 EF BF BE and EF BF BF, are not XML characters either. */
    for (char *c = strstr(copy, "\xef\xbf"); c != NULL; c = strstr(c + 2, "\xef\xbf"))
        if ((unsigned char)c[2] >= 0xbe)
            /* NOLINTNEXTLINE(bugprone-not-null-terminated-result): into a longer text. */
            memcpy(c, "???", 3);
    return copy;
}

static bool attribute(xmlTextWriter *w, const char *name, const char *value)
{
    char *text = xml_text(value);
    bool ok = text != NULL && xmlTextWriterWriteAttribute(w, BAD_CAST name, BAD_CAST text) >= 0;
    free(text);
    return ok;
}

static bool number_attribute(xmlTextWriter *w, const char *name, const char *format, double value)
{
    char text[64];
    snprintf(text, sizeof text, format, value);
    return attribute(w, name, text);
}

static bool write_text(xmlTextWriter *w, const char *value)
{
    char *text = xml_text(value);
    bool ok = text != NULL && xmlTextWriterWriteString(w, BAD_CAST text) >= 0;
    free(text);
    return ok;
}

/* The numbers of a claim; those of a row of noise are in its reason. */
static bool write_numbers(xmlTextWriter *w, const json_t *claim)
{
    if (json_object_get(claim, "mdb_global") == NULL)
        return write_text(w, member_text(claim, "reason"));
    const json_t *ci = json_object_get(claim, "ci");
    char text[512], mdb[32];
    snprintf(
        text, sizeof text,
        "difference %+.4f %% [%+.4f, %+.4f], margin %.4f %%, minimum detectable bias %s, "
        "log10 p %.2f, alpha %.3g over %.0f tests",
        100 * member_number(claim, "difference"), 100 * json_number_value(json_array_get(ci, 0)),
        100 * json_number_value(json_array_get(ci, 1)), 100 * member_number(claim, "margin_global"),
        region_mdb_text(member_number(claim, "mdb_global"), mdb), member_number(claim, "log10_p"),
        member_number(claim, "alpha"), member_number(claim, "num_tests"));
    return write_text(w, text);
}

static bool write_verdict(xmlTextWriter *w, const json_t *claim, enum outcome outcome)
{
    if (outcome == OUTCOME_NOT_JUDGED)
        return xmlTextWriterStartElement(w, BAD_CAST "error") >= 0 &&
               attribute(w, "type", "not judged") &&
               attribute(w, "message", member_text(claim, "error")) &&
               xmlTextWriterEndElement(w) >= 0;
    if (outcome == OUTCOME_AS_EXPECTED)
        return true; /* its numbers are in the suite's output: Ant's schema lets a test that passes say nothing */
    char message[128];
    snprintf(message, sizeof message, "%.40s, expected %.40s", member_text(claim, "verdict"),
             member_text(claim, "expected"));
    return xmlTextWriterStartElement(w, BAD_CAST "failure") >= 0 &&
           attribute(w, "type", member_text(claim, "verdict")) &&
           attribute(w, "message", message) && write_text(w, member_text(claim, "reason")) &&
           write_text(w, "\n") && write_numbers(w, claim) && xmlTextWriterEndElement(w) >= 0;
}

static bool write_name(xmlTextWriter *w, const json_t *claim)
{
    const char *quantity = member_text(claim, "quantity");
    return write_text(w, member_text(claim, "a")) && write_text(w, " against ") &&
           write_text(w, member_text(claim, "b")) && write_text(w, ": ") &&
           write_text(w, quantity != NULL ? quantity : "mean");
}

static bool write_testcase(xmlTextWriter *w, const json_t *claim)
{
    return xmlTextWriterStartElement(w, BAD_CAST "testcase") >= 0 &&
           attribute(w, "classname", member_text(claim, "scene")) &&
           xmlTextWriterStartAttribute(w, BAD_CAST "name") >= 0 && write_name(w, claim) &&
           xmlTextWriterEndAttribute(w) >= 0 &&
           number_attribute(w, "time", "%.3f", member_number(claim, "seconds_a")) &&
           write_verdict(w, claim, results_claim_outcome(claim)) && xmlTextWriterEndElement(w) >= 0;
}

/* <system-out>: a line for each claim that came out as expected. */
static bool write_output(xmlTextWriter *w, const json_t *claims)
{
    bool ok = xmlTextWriterStartElement(w, BAD_CAST "system-out") >= 0;
    for (size_t i = 0; ok && i < json_array_size(claims); i++) {
        const json_t *claim = json_array_get(claims, i);
        ok = results_claim_outcome(claim) != OUTCOME_AS_EXPECTED ||
             (write_text(w, member_text(claim, "scene")) && write_text(w, ": ") &&
              write_name(w, claim) && write_text(w, ": ") && write_numbers(w, claim) &&
              write_text(w, "\n"));
    }
    return ok && xmlTextWriterEndElement(w) >= 0 &&
           xmlTextWriterWriteElement(w, BAD_CAST "system-err", BAD_CAST "") >= 0;
}

static bool write_testsuite(xmlTextWriter *w, const json_t *results, const json_t *claims)
{
    size_t num = json_array_size(claims), count[4] = {0};
    for (size_t i = 0; i < num; i++)
        count[results_claim_outcome(json_array_get(claims, i))]++;
    size_t failures = count[OUTCOME_OPPOSITE] + count[OUTCOME_UNDECIDED];
    char date[20]; /* without its zone, which is UTC: Ant's schema has none */
    snprintf(date, sizeof date, "%.19s", member_or_empty(results, "date"));
    bool ok = xmlTextWriterSetIndent(w, 1) >= 0 &&
              xmlTextWriterStartDocument(w, NULL, "UTF-8", NULL) >= 0 &&
              xmlTextWriterStartElement(w, BAD_CAST "testsuite") >= 0 &&
              attribute(w, "name", "assay") && number_attribute(w, "tests", "%.0f", (double)num) &&
              number_attribute(w, "failures", "%.0f", (double)failures) &&
              number_attribute(w, "errors", "%.0f", (double)count[OUTCOME_NOT_JUDGED]) &&
              number_attribute(w, "time", "%.3f", member_number(results, "seconds")) &&
              attribute(w, "timestamp", date) && attribute(w, "hostname", "localhost") &&
              xmlTextWriterWriteElement(w, BAD_CAST "properties", BAD_CAST "") >= 0;
    for (size_t i = 0; ok && i < num; i++)
        ok = write_testcase(w, json_array_get(claims, i));
    return ok && write_output(w, claims) && xmlTextWriterEndDocument(w) >= 0;
}

bool junit_write(const char *path, const json_t *results, struct err *e)
{
    bool failed = false;
    xml_errors_to(&failed);
    xmlBuffer *buffer = xmlBufferCreate();
    xmlTextWriter *writer = buffer != NULL ? xmlNewTextWriterMemory(buffer, 0) : NULL;
    json_t *claims = json_copy(json_object_get(results, "claims")),
           *noise = noise_results_claims(json_object_get(results, "noise"));
    bool ok = writer != NULL && claims != NULL && noise != NULL &&
              json_array_extend(claims, noise) == 0 && write_testsuite(writer, results, claims);
    json_decref(claims);
    json_decref(noise);
    xmlFreeTextWriter(writer);
    ok = ok && !failed;
    xml_errors_to(NULL);
    struct out_file out;
    if (!ok) {
        /* results_read() has seen that all of it is there and UTF-8. */
        err_set(e, "%s: out of memory for the JUnit XML", path);
    } else if (!fs_make_parent_dirs(path, e) || !out_open(&out, path, e)) {
        ok = false;
    } else {
        fwrite(xmlBufferContent(buffer), 1, (size_t)xmlBufferLength(buffer), out.f);
        ok = out_commit(&out, e);
    }
    if (buffer != NULL)
        xmlBufferFree(buffer);
    return ok;
}
