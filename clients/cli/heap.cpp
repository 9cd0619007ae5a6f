#include "heap.hpp"

#include <cstdint>
#include <cstdlib>

#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

namespace penumbra::cli {

// Huge pages have no part in what is computed: where any of this is refused, all works as before.
void use_huge_pages()
{
    constexpr std::uintptr_t huge_page = 2 << 20;
    constexpr int step = 512 << 20, largest_in_heap = 32 << 20;
    mallopt(M_ARENA_MAX, 1);
    mallopt(M_TOP_PAD, step);
    mallopt(M_TRIM_THRESHOLD, step);
    mallopt(M_MMAP_THRESHOLD, largest_in_heap);

    // The linkers that PoCL starts, one a kernel, read it as they start.
    setenv("GLIBC_TUNABLES", "glibc.malloc.hugetlb=1:glibc.malloc.top_pad=134217728", 0);

    // Make the heap grow its first step, then ask for huge pages in what is not yet touched.
    void* const grown = std::malloc(1 << 20);
    const auto first = (reinterpret_cast<std::uintptr_t>(grown) + huge_page - 1) / huge_page * huge_page;
    char* const top = static_cast<char*>(sbrk(0));
    const auto top_address = reinterpret_cast<std::uintptr_t>(top);
    const auto end = top_address / huge_page * huge_page;
    std::free(grown);
    if (first < end) madvise(top - (top_address - first), end - first, MADV_HUGEPAGE);
}

} // namespace penumbra::cli
