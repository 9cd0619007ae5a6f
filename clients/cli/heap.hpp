// How the process takes its memory.
#pragma once

namespace penumbra::cli {

// From now on malloc, in all threads, takes its memory from one heap that grows in large steps and has huge pages. Called first in main().
//
// To compile its first kernel PoCL reads a library of 10 MB into some 200 MB of small objects. In pages of 4 KiB that is 50,000 page faults,
// on a virtual machine a quarter of the first mask's time.
void use_huge_pages();

} // namespace penumbra::cli
