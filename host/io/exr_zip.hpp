// EXR's ZIP: a chunk's bytes at even places, then those at odd places; each replaced by its difference to the one before (plus 128);
// deflated. OpenEXRCore 3.1 has this too, but by zlib, which takes twice as long; and what it deflates to the very size that it had, its
// own and every other reader take for stored bytes.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

struct libdeflate_compressor;
struct libdeflate_decompressor;

namespace penumbra {

// One a thread.
class ExrInflater {
public:
    ExrInflater();
    // Fills `bytes`; false when `packed` is broken.
    bool inflate(std::span<const unsigned char> packed, std::span<unsigned char> bytes);

private:
    struct Free {
        void operator()(libdeflate_decompressor* decompressor) const;
    };
    std::unique_ptr<libdeflate_decompressor, Free> decompressor_;
    std::vector<unsigned char> apart_;
};

class ExrDeflater {
public:
    ExrDeflater();
    // The length of the result, which is shorter than `bytes`, at the front of `packed`; 0 when there is none: then bytes are stored as
    // they are. `packed` has room for `bytes`.
    std::size_t deflate(std::span<const unsigned char> bytes, std::span<unsigned char> packed);

private:
    struct Free {
        void operator()(libdeflate_compressor* compressor) const;
    };
    std::unique_ptr<libdeflate_compressor, Free> compressor_;
    std::vector<unsigned char> apart_;
};

} // namespace penumbra
