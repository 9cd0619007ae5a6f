#include "scene/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <sched.h>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <vector>

#include <penumbra/error.hpp>

#include "scene/stop.hpp"

namespace penumbra {

unsigned processor_count()
{
    // The mask's size is the kernel's choice: grow until it fits.
    for (int processors = CPU_SETSIZE; processors <= (1 << 20); processors *= 2) {
        cpu_set_t* mask = CPU_ALLOC(static_cast<std::size_t>(processors));
        if (!mask) break;
        const std::size_t bytes = CPU_ALLOC_SIZE(static_cast<std::size_t>(processors));
        const bool known = sched_getaffinity(0, bytes, mask) == 0;
        const int count = known ? CPU_COUNT_S(bytes, mask) : 0;
        CPU_FREE(mask);
        if (known) return static_cast<unsigned>(std::max(count, 1));
    }
    return std::max(std::thread::hardware_concurrency(), 1u);
}

unsigned thread_count()
{
    const char* const setting = std::getenv("PENUMBRA_THREADS");
    if (!setting || !*setting) return processor_count();

    const std::string_view text(setting);
    unsigned count = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
    if (error != std::errc() || end != text.data() + text.size() || count < 1 || count > 1024)
        throw Error(ErrorCode::usage, "PENUMBRA_THREADS: is \"" + std::string(text) + "\"", "expected a whole number from 1 to 1024");
    return count;
}

void parallel_for(int count, const std::function<void(int)>& body)
{
    if (count <= 0) return;

    std::atomic<int> next{0};
    std::mutex guard;
    std::exception_ptr first;

    // Every thread takes the next index until none is left or one of them has failed.
    const auto work = [&, stop = current_stop()] {
        const StopScope scope(stop);
        for (int i = next.fetch_add(1); i < count; i = next.fetch_add(1)) {
            try {
                check_stop(stop.get());
                body(i);
            } catch (...) {
                const std::lock_guard lock(guard);
                if (!first) first = std::current_exception();
                next.store(count);
            }
        }
    };

    {
        std::vector<std::jthread> others;
        const unsigned threads = std::min(thread_count(), static_cast<unsigned>(count));
        try {
            others.reserve(threads - 1);
            for (unsigned i = 1; i < threads; ++i) others.emplace_back(work);
        } catch (const std::system_error&) {
            // The system gives no more threads: those that run do all the work.
        }
        work();
    }
    if (first) std::rethrow_exception(first);
}

} // namespace penumbra
