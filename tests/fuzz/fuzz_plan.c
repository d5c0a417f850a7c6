/* plan.jsonl as it is, and again behind a valid head line, so that its jobs are read too. */
#include "renderer/base/version.h"
#include "tools/jobs/plan.h"
#include "fuzz.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void look(const char *dir)
{
    struct plan p;
    struct err e = {""};
    if (!plan_read(dir, &p, &e)) {
        fuzz_check_line(&e, dir);
        return;
    }
    for (int k = 0; k < p.num; k++) {
        const struct path path = job_run_artefact(&p, k, NULL);
        fuzz_require(!job_run_is_made(&p, k), "a job is made where nothing is");
        fuzz_require(strncmp(path.s, dir, strlen(dir)) == 0 && strstr(path.s, "..") == NULL,
                     "an artefact outside the plan");
        fuzz_require(!job_run_verify(&p, k, &e), "a job is whole where nothing is");
        fuzz_check_line(&e, NULL);
    }
    int num = 0;
    char **word = plan_words(json_object_get(p.head, "command"), &num);
    fuzz_require(word != NULL && word[num] == NULL, "a command without an end");
    free(word);
    plan_free(&p);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const char *dir = fuzz_dir(fuzz_file(data, size, ".jsonl"), "plan.jsonl");
    look(dir);
    int jobs = 1;
    for (size_t i = 0; i < size; i++)
        jobs += data[i] == '\n' && i + 1 < size;
    char *whole = malloc(size + 512);
    fuzz_require(whole != NULL, "out of memory");
    int n = snprintf(whole, 512,
                     "{\"assay_plan\":1,\"kind\":\"pathtracer\",\"version\":\"%s\",\"cwd\":\"/\","
                     "\"jobs\":%d,\"command\":[\"pathtracer\"],\"output\":\"x\",\"product\":\"x\","
                     "\"ends\":[0],\"cpus\":1,\"run\":[\"x\"],\"inputs\":{}}\n",
                     assay_version, jobs);
    memcpy(whole + n, data, size);
    fuzz_file((const uint8_t *)whole, (size_t)n + size, ".jsonl");
    free(whole);
    look(dir);
    return 0;
}
