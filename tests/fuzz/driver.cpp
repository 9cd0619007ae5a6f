// Runs a target without libFuzzer, which needs clang: the stored inputs as they stand, then changes of them. Input number i depends on the
// seed, i and the corpus alone, so a failure can be had again by its number.
//
// Beside what the target checks itself, an input may neither
//   - take more than `most_cpu_s` of processor time,
//   - make the process grow by more than `most_growth_bytes`, nor ask for one piece of memory of more than `most_allocation_mb`, nor
//   - make anything print: the library prints nothing, and what it is made of must not either.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

#include "fuzz/mutator.hpp"
#include "fuzz/target.hpp"

using penumbra::fuzz::Input;
using penumbra::fuzz::Mutator;

extern "C" __attribute__((weak)) std::size_t LLVMFuzzerCustomMutator(std::uint8_t*, std::size_t, std::size_t, unsigned);

namespace {

// An input is at most this long.
constexpr std::size_t max_input_bytes = std::size_t{64} << 10;

// Under the sanitizers, below. Deflate makes at most 1032 times as much of an input (64 MiB), and a vector that grows doubles.
[[maybe_unused]] constexpr int most_allocation_mb = 128;

// A few such pieces, and what the address sanitizer keeps of freed memory (64 MiB, below) with its fringes.
constexpr std::int64_t most_growth_bytes = std::int64_t{512} << 20;

// The slowest sound input takes some 10 ms in a debug build under the sanitizers.
constexpr int most_cpu_s = 10;

struct Arguments {
    std::uint64_t seed = 1, first = 0, runs = 1000;
    double seconds = 0; // 0: until `runs` are done
    std::string dictionary, failures = ".";
    std::vector<std::string> corpus;
};

constexpr const char* usage =
    "Usage: fuzz_TARGET [--runs N] [--seconds S] [--seed N] [--first I] [--dictionary FILE] [--failures DIR] CORPUS...\n"
    "\n"
    "Runs the files of CORPUS (files and folders), then N changed ones, or as many as S seconds allow, from number I on. The "
    "environment's\n"
    "PENUMBRA_FUZZ_SECONDS counts as --seconds. An input that fails is written to DIR. Exit codes: 0 none failed, 2 wrong usage; else a "
    "signal.\n";

Arguments arguments_from(int count, char** values)
{
    Arguments result;
    if (const char* seconds = std::getenv("PENUMBRA_FUZZ_SECONDS")) result.seconds = std::stod(seconds);
    for (int i = 1; i < count; ++i) {
        const std::string argument = values[i];
        if (!argument.starts_with("--")) {
            result.corpus.push_back(argument);
            continue;
        }
        if (i + 1 == count) throw std::runtime_error(argument + ": expected a value");
        const std::string value = values[++i];
        if (argument == "--runs")
            result.runs = std::stoull(value);
        else if (argument == "--seconds")
            result.seconds = std::stod(value);
        else if (argument == "--seed")
            result.seed = std::stoull(value);
        else if (argument == "--first")
            result.first = std::stoull(value);
        else if (argument == "--dictionary")
            result.dictionary = value;
        else if (argument == "--failures")
            result.failures = value;
        else
            throw std::runtime_error(argument + ": unknown");
    }
    if (result.corpus.empty()) throw std::runtime_error("CORPUS: expected at least one file or folder");
    return result;
}

struct Stored {
    std::string path;
    Input input;
};

// In the order of their names.
std::vector<Stored> read_corpus(const std::vector<std::string>& paths)
{
    std::vector<std::string> files;
    for (const std::string& path : paths) {
        if (!std::filesystem::is_directory(path)) {
            files.push_back(path);
            continue;
        }
        for (const auto& entry : std::filesystem::directory_iterator(path)) files.push_back(entry.path().string());
    }
    std::ranges::sort(files);
    std::vector<Stored> stored;
    for (const std::string& path : files) {
        std::ifstream file(path, std::ios::binary);
        if (!file) throw std::runtime_error(path + ": cannot be read");
        stored.push_back({path, Input(std::istreambuf_iterator<char>(file), {})});
        if (stored.back().input.size() > max_input_bytes)
            throw std::runtime_error(path + ": over " + std::to_string(max_input_bytes) + " bytes");
    }
    if (stored.empty()) throw std::runtime_error("CORPUS: has no files");
    return stored;
}

// What the handler of signals tells; it may use nothing that allocates or locks.
struct Failure {
    const std::uint8_t* data = nullptr;
    std::size_t size = 0;
    char name[256] = ""; // of the input, for people
    char path[512] = ""; // where it will be written
    int messages = -1;   // the standard error that the driver was started with
    int captured = -1;   // what was printed since
};
Failure failure;

void say(const char* text)
{
    if (::write(failure.messages, text, std::strlen(text)) < 0) return; // nobody is left to tell
}

void copy_captured()
{
    char buffer[4096];
    ::lseek(failure.captured, 0, SEEK_SET);
    for (ssize_t got = 0; (got = ::read(failure.captured, buffer, sizeof buffer)) > 0;)
        if (::write(failure.messages, buffer, static_cast<std::size_t>(got)) < 0) return;
}

void save_input()
{
    const int file = ::open(failure.path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (file < 0 || ::write(file, failure.data, failure.size) < 0) say("fuzz: the input cannot be written\n");
    if (file >= 0) ::close(file);
}

extern "C" void end_with_input(int signal)
{
    copy_captured();
    say(signal == SIGPROF ? "fuzz: too slow: " : "fuzz: failed: ");
    say(failure.name);
    say("\nfuzz: the input is in ");
    say(failure.path);
    say("\n");
    save_input();
    ::signal(signal, SIG_DFL);
    ::raise(signal);
}

// From now on everything that is printed is caught.
void catch_everything()
{
    failure.messages = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 10);
    failure.captured = ::memfd_create("captured", MFD_CLOEXEC);
    if (failure.messages < 0 || failure.captured < 0) throw std::runtime_error("no memory for what is printed");
    ::dup2(failure.captured, STDERR_FILENO);
    ::dup2(failure.captured, STDOUT_FILENO);
    for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGPROF}) {
        struct sigaction before {};
        ::sigaction(signal, nullptr, &before);
        // The sanitizers' own handlers stay: they report, then abort.
        if (before.sa_handler == SIG_DFL) ::signal(signal, end_with_input);
    }
}

std::int64_t peak_bytes()
{
    rusage used{};
    ::getrusage(RUSAGE_SELF, &used);
    return std::int64_t{used.ru_maxrss} << 10;
}

// Without a sanitizer, which has limits of its own and maps terabytes: nothing larger than the growth allowed can be had. Of what can be
// written, as glibc reserves 64 MiB of addresses, and 128 for a moment, for each thread that allocates: a library's threads would use up a
// limit of addresses before an input does.
void limit_memory()
{
#ifndef __SANITIZE_ADDRESS__
    std::int64_t size = 0, resident = 0, shared = 0, text = 0, libraries = 0, data = 0; // proc(5), statm
    std::ifstream("/proc/self/statm") >> size >> resident >> shared >> text >> libraries >> data;
    const auto limit = static_cast<rlim_t>(data * ::sysconf(_SC_PAGESIZE) + most_growth_bytes);
    const rlimit both{limit, limit};
    ::setrlimit(RLIMIT_DATA, &both);
#endif
}

void limit_time(int seconds)
{
    const itimerval timer{{0, 0}, {seconds, 0}};
    ::setitimer(ITIMER_PROF, &timer, nullptr);
}

void run(const Input& input, const std::string& name, const std::string& path)
{
    // A copy of its very size, so that reading past its end is noticed.
    const auto exact = std::make_unique<std::uint8_t[]>(input.size());
    std::ranges::copy(input, exact.get());
    failure.data = exact.get();
    failure.size = input.size();
    name.copy(failure.name, sizeof failure.name - 1);
    failure.name[std::min(name.size(), sizeof failure.name - 1)] = 0;
    path.copy(failure.path, sizeof failure.path - 1);
    failure.path[std::min(path.size(), sizeof failure.path - 1)] = 0;

    static const std::int64_t before = peak_bytes();
    limit_time(most_cpu_s);
    try {
        LLVMFuzzerTestOneInput(exact.get(), input.size());
    } catch (const std::exception& error) {
        // Here, where the input still is: it is written out by what handles the abort.
        penumbra::fuzz::fail(std::string("an exception that is no penumbra::Error: ") + error.what());
    }
    limit_time(0);

    std::fflush(nullptr);
    if (::lseek(failure.captured, 0, SEEK_END) != 0) penumbra::fuzz::fail("something was printed (above)");
    if (peak_bytes() - before > most_growth_bytes)
        penumbra::fuzz::fail("the process grew by " + std::to_string((peak_bytes() - before) >> 20) + " MiB");
}

Mutator* current = nullptr;

Input changed(const Input& input, std::uint64_t seed)
{
    Input buffer(max_input_bytes);
    std::ranges::copy(input, buffer.begin());
    const auto mutate =
        LLVMFuzzerCustomMutator ? LLVMFuzzerCustomMutator : [](std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned) {
            return LLVMFuzzerMutate(data, size, max_size);
        };
    buffer.resize(mutate(buffer.data(), input.size(), max_input_bytes, static_cast<unsigned>(seed)));
    return buffer;
}

// Independent streams for every number: the multiplier is 2^64 over the golden ratio.
std::uint64_t mixed(std::uint64_t seed, std::uint64_t number) { return (seed << 40) + number * 0x9e3779b97f4a7c15u; }

void run_all(const Arguments& arguments)
{
    const std::vector<Stored> stored = read_corpus(arguments.corpus);
    const std::vector<Input> tokens =
        arguments.dictionary.empty() ? std::vector<Input>() : penumbra::fuzz::read_dictionary(arguments.dictionary);
    std::vector<Input> corpus;
    for (const Stored& one : stored) corpus.push_back(one.input);
    const std::string failures = arguments.failures + "/fuzz-" + std::filesystem::path(arguments.corpus.front()).filename().string() + "-";

    catch_everything();
    limit_memory();
    for (const Stored& one : stored) run(one.input, one.path, failures + std::filesystem::path(one.path).filename().string());

    using Clock = std::chrono::steady_clock;
    const auto begin = Clock::now();
    const auto seconds = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
    std::uint64_t number = arguments.first;
    for (; arguments.seconds > 0 ? seconds() < arguments.seconds : number < arguments.first + arguments.runs; ++number) {
        Mutator mutator(corpus, tokens, mixed(arguments.seed, number));
        current = &mutator;
        const Input input = changed(corpus[mutator.below(corpus.size())], number);
        run(input, "--seed " + std::to_string(arguments.seed) + " --first " + std::to_string(number) + " --runs 1",
            failures + std::to_string(arguments.seed) + "-" + std::to_string(number));
    }
    ::dup2(failure.messages, STDERR_FILENO);
    std::fprintf(stderr, "%zu stored inputs, %llu changed ones (seed %llu, %llu to %llu) in %.1f s, at most %lld MiB\n", stored.size(),
                 static_cast<unsigned long long>(number - arguments.first), static_cast<unsigned long long>(arguments.seed),
                 static_cast<unsigned long long>(arguments.first), static_cast<unsigned long long>(number), seconds(),
                 static_cast<long long>(peak_bytes() >> 20));
}

} // namespace

// The sanitizers' defaults; ASAN_OPTIONS and UBSAN_OPTIONS of the environment come on top. Aborting ends in end_with_input. Too large a
// request for memory is a failure, and so is one that new would answer with an exception.
extern "C" __attribute__((visibility("default"))) const char* __asan_default_options();
extern "C" const char* __asan_default_options()
{
    return "abort_on_error=1:allocator_may_return_null=0:quarantine_size_mb=64:max_allocation_size_mb=128"; // most_allocation_mb
}
extern "C" __attribute__((visibility("default"))) const char* __ubsan_default_options();
extern "C" const char* __ubsan_default_options() { return "abort_on_error=1"; }

std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size)
{
    Input input(data, data + size);
    current->mutate(input, max_size);
    std::ranges::copy(input, data);
    return input.size();
}

int main(int count, char** values)
{
    try {
        run_all(arguments_from(count, values));
        return 0;
    } catch (const std::exception& error) {
        if (failure.messages >= 0) ::dup2(failure.messages, STDERR_FILENO);
        std::fprintf(stderr, "fuzz: %s\n\n%s", error.what(), usage);
        return 2;
    }
}
