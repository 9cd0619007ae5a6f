// What the fuzz targets share. A target is one function, LLVMFuzzerTestOneInput, that driver.cpp or libFuzzer calls with bytes that may be
// anything. It returns when they were read or refused as promised, and aborts when a promise was broken.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include <penumbra/error.hpp>

extern "C" {
// What libFuzzer knows them as; driver.cpp has the same.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);
// Where a target has one, it is called in place of LLVMFuzzerMutate.
std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned seed);
}

namespace penumbra::fuzz {

// The largest image in samples that a target lets be read, so that little memory is enough to tell that a limit is overlooked.
constexpr std::uint64_t max_samples = 1 << 16;

[[noreturn]] inline void fail(const std::string& what)
{
    std::fprintf(stderr, "fuzz: %s\n", what.c_str());
    std::abort();
}

inline void expect(bool holds, const std::string& what)
{
    if (!holds) fail(what);
}

// One line without control characters, in UTF-8: what a terminal, a log and a JSON document can take.
inline void expect_message(std::string_view text)
{
    expect(!text.empty(), "an error without a message");
    for (const char c : text) expect(static_cast<unsigned char>(c) >= 0x20, "an error with control characters: " + std::string(text));
    try {
        (void)nlohmann::json(text).dump();
    } catch (const nlohmann::json::exception&) {
        fail("an error that is not UTF-8: " + std::string(text));
    }
}

// Whether `act` ended without an error of the library. Anything else that it throws leaves the target, and ends it.
template <class Act> bool accepted(const Act& act)
{
    try {
        act();
        return true;
    } catch (const Error& error) {
        expect_message(error.what());
        expect(error.code() != ErrorCode::internal, std::string("a defect is blamed on the input: ") + error.what());
        return false;
    }
}

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) { return {reinterpret_cast<const char*>(data), size}; }

inline std::span<const std::byte> bytes_of(const std::uint8_t* data, std::size_t size) { return std::as_bytes(std::span(data, size)); }

} // namespace penumbra::fuzz
