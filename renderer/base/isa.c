#include "isa.h"

#include <stddef.h>

const char *const isa_names[] = {"scalar", "auto", "sse4.2", "avx2", "avx512", NULL};

static bool machine_has(enum isa isa)
{
    switch (isa) {
    case ISA_SCALAR: return true;
    case ISA_AUTO: break;
    case ISA_SSE42: return __builtin_cpu_supports("sse4.2");
    case ISA_AVX2: return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    case ISA_AVX512:
        return machine_has(ISA_AVX2) && __builtin_cpu_supports("avx512f") &&
               __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw") &&
               __builtin_cpu_supports("avx512dq");
    }
    return false;
}

bool isa_choose(enum isa *isa, struct err *e)
{
    if (*isa != ISA_AUTO)
        return machine_has(*isa) || err_set(e, "--isa: this machine has no %s", isa_names[*isa]);
    for (enum isa i = ISA_AVX512; i > ISA_AUTO; i--)
        if (machine_has(i)) {
            *isa = i;
            return true;
        }
    return err_set(e, "the wide kernels need a machine with %s", isa_names[ISA_SSE42]);
}
