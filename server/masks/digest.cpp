#include "masks/digest.hpp"

#include <array>
#include <cstdint>

#include <openssl/evp.h>

#include <penumbra/error.hpp>

namespace penumbra::server {
namespace {

void require(int ok)
{
    if (ok != 1) throw Error(ErrorCode::internal, "SHA-256 is not to be had from OpenSSL");
}

} // namespace

struct Digest::State {
    EVP_MD_CTX* context = EVP_MD_CTX_new();
    ~State() { EVP_MD_CTX_free(context); }
};

Digest::Digest() : state_(std::make_unique<State>()) { require(EVP_DigestInit_ex(state_->context, EVP_sha256(), nullptr)); }
Digest::~Digest() = default;

Digest& Digest::add(std::string_view piece)
{
    const std::uint64_t size = piece.size();
    std::array<unsigned char, 8> length{};
    for (std::size_t i = 0; i < length.size(); ++i) length[i] = static_cast<unsigned char>(size >> (8 * i));
    require(EVP_DigestUpdate(state_->context, length.data(), length.size()));
    require(EVP_DigestUpdate(state_->context, piece.data(), piece.size()));
    return *this;
}

std::string Digest::hex()
{
    std::array<unsigned char, EVP_MAX_MD_SIZE> bytes{};
    unsigned size = 0;
    require(EVP_DigestFinal_ex(state_->context, bytes.data(), &size));
    std::string text;
    for (unsigned i = 0; i < size; ++i) {
        text += "0123456789abcdef"[bytes[i] >> 4];
        text += "0123456789abcdef"[bytes[i] & 15];
    }
    return text;
}

} // namespace penumbra::server
