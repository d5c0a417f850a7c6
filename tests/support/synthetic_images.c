#include "synthetic_images.h"

static struct block draw_block(struct library *l)
{
    struct block b = {0, 0, 0};
    for (int i = 0; i < l->n; i++) {
        double x = draw(l->law, &l->state) - 1;
        b.s1 += x;
        b.s2 += x * x;
        b.s3 += x * x * x;
    }
    return b;
}

void library_renew(struct library *l, size_t num)
{
    for (size_t i = 0; i < num; i++) {
        struct block *b = &l->block[l->next];
        l->sum -= b->s1;
        *b = draw_block(l);
        l->sum += b->s1;
        l->next = l->next + 1 == l->num ? 0 : l->next + 1;
    }
}

bool library_init(struct library *l, enum law law, int n, size_t num, uint64_t seed, struct err *e)
{
    *l = (struct library){.law = law, .n = n, .num = num, .state = seed};
    l->block = calloc(num, sizeof *l->block);
    if (l->block == NULL)
        return err_set(e, "out of memory for %zu blocks of draws", num);
    library_renew(l, num);
    return true;
}

void library_free(struct library *l)
{
    free(l->block);
    *l = (struct library){0};
}

double library_mean(const struct library *l)
{
    return 1 + l->sum / ((double)l->num * l->n);
}

static void pick(struct library *l, int merge, struct moments *m, size_t i)
{
    struct block sum = {0, 0, 0};
    for (int k = 0; k < merge; k++) {
        const struct block *b = &l->block[(size_t)(uniform(&l->state) * (double)l->num)];
        sum.s1 += b->s1;
        sum.s2 += b->s2;
        sum.s3 += b->s3;
    }
    double shift = sum.s1 / ((double)merge * l->n);
    m->mean[i] = fmax(0, 1 + shift);
    m->m2[i] = fmax(0, sum.s2 - sum.s1 * shift);
    m->m3[i] = sum.s3 - 3 * sum.s2 * shift + 2 * sum.s1 * shift * shift;
}

void library_image(struct library *l, int merge, bool is_grey, const struct moments *other,
                   struct moments *m)
{
    size_t values = 3 * (size_t)m->width * (size_t)m->height;
    for (size_t i = 0; i < values; i++) {
        m->n[i / 3] = (double)merge * l->n;
        if (is_grey && i % 3 > 0) {
            m->mean[i] = m->mean[i - 1];
            m->m2[i] = m->m2[i - 1];
            m->m3[i] = m->m3[i - 1];
            continue;
        }
        do
            pick(l, merge, m, i);
        while (other != NULL && m->m2[i] > 0 && m->m2[i] == other->m2[i] &&
               m->mean[i] == other->mean[i]);
    }
}
