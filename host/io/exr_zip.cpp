#include "io/exr_zip.hpp"

#include <libdeflate.h>

#include <penumbra/error.hpp>

namespace penumbra {

namespace {

constexpr int fastest = 1;

template <class Pointer> Pointer made(Pointer pointer)
{
    if (!pointer) throw Error(ErrorCode::internal, "no memory to pack or unpack an EXR");
    return pointer;
}

} // namespace

void ExrInflater::Free::operator()(libdeflate_decompressor* decompressor) const { libdeflate_free_decompressor(decompressor); }
void ExrDeflater::Free::operator()(libdeflate_compressor* compressor) const { libdeflate_free_compressor(compressor); }

ExrInflater::ExrInflater() : decompressor_(made(libdeflate_alloc_decompressor())) {}
ExrDeflater::ExrDeflater() : compressor_(made(libdeflate_alloc_compressor(fastest))) {}

bool ExrInflater::inflate(std::span<const unsigned char> packed, std::span<unsigned char> bytes)
{
    apart_.resize(bytes.size());
    if (libdeflate_zlib_decompress(decompressor_.get(), packed.data(), packed.size(), apart_.data(), apart_.size(), nullptr) !=
        LIBDEFLATE_SUCCESS)
        return false;
    unsigned sum = 128;
    for (unsigned char& byte : apart_) byte = static_cast<unsigned char>(sum += byte ^ 128u); // - 128, in bytes
    const unsigned char *even = apart_.data(), *odd = even + (bytes.size() + 1) / 2;
    for (std::size_t i = 0; i < bytes.size() / 2; ++i) {
        bytes[2 * i] = even[i];
        bytes[2 * i + 1] = odd[i];
    }
    if (bytes.size() % 2 != 0) bytes.back() = even[bytes.size() / 2];
    return true;
}

std::size_t ExrDeflater::deflate(std::span<const unsigned char> bytes, std::span<unsigned char> packed)
{
    apart_.resize(bytes.size());
    unsigned char *even = apart_.data(), *odd = even + (bytes.size() + 1) / 2;
    for (std::size_t i = 0; i < bytes.size(); ++i) (i % 2 == 0 ? even : odd)[i / 2] = bytes[i];
    unsigned before = 128;
    for (unsigned char& byte : apart_) {
        const unsigned here = byte;
        byte = static_cast<unsigned char>(here - before + 128);
        before = here;
    }
    return libdeflate_zlib_compress(compressor_.get(), apart_.data(), apart_.size(), packed.data(), bytes.size() - 1);
}

} // namespace penumbra
