// Intel, Software Developer's Manual, vol. 1, 14.3 and 15.2: the processor must have the instructions (cpuid), and the
// operating system must keep their registers (xgetbv). The compiler's own test of this needs its run-time library,
// which not every compiler has.
#include "processor.hpp"

#include <stdlib.h>
#include <string.h>

#include "export.hpp"

#if defined(CREEPKIT_HAS_X86_LANES)
#include <cpuid.h>
#endif

namespace creepkit {

static int64_t detected_lanes() {
#if defined(CREEPKIT_HAS_X86_LANES)
    constexpr uint32_t FMA = 1u << 12, OSXSAVE = 1u << 27, AVX = 1u << 28;                // leaf 1, ecx
    constexpr uint32_t AVX2 = 1u << 5, AVX512 = 1u << 16 | 1u << 17 | 1u << 31;           // leaf 7, ebx: F, DQ, VL
    constexpr uint32_t YMM = 1u << 1 | 1u << 2, ZMM = YMM | 1u << 5 | 1u << 6 | 1u << 7;  // xcr0
    uint32_t a, b, c, d, features, kept, upper;
    if (!__get_cpuid(1, &a, &b, &c, &d) || (c & (FMA | OSXSAVE | AVX)) != (FMA | OSXSAVE | AVX)) return 2;
    if (!__get_cpuid_count(7, 0, &a, &features, &c, &d)) return 2;
    __asm__ volatile("xgetbv" : "=a"(kept), "=d"(upper) : "c"(0));
    if ((kept & YMM) != YMM || !(features & AVX2)) return 2;
    return (kept & ZMM) == ZMM && (features & AVX512) == AVX512 ? 8 : 4;
#else
    return 2;
#endif
}

// Asked once: in a virtual machine cpuid takes microseconds. Threads that come first at the same time write the same.
int64_t processor_lanes() {
    static int64_t known = 0;
    int64_t lanes = __atomic_load_n(&known, __ATOMIC_RELAXED);
    if (lanes == 0) {
        lanes = detected_lanes();
        __atomic_store_n(&known, lanes, __ATOMIC_RELAXED);
    }
    return lanes;
}

int64_t chosen_lanes() {
    const int64_t most = processor_lanes();
    const char* wanted = getenv("CREEPKIT_LANES");
    if (!wanted || strlen(wanted) != 1) return most;
    const int64_t lanes = wanted[0] - '0';
    return (lanes == 2 || lanes == 4 || lanes == 8) && lanes <= most ? lanes : most;
}

}  // namespace creepkit

CREEPKIT_API int64_t creepkit_core_lanes() { return creepkit::chosen_lanes(); }
