// SHA-256, for names that follow from content.
#pragma once

#include <memory>
#include <string>
#include <string_view>

namespace penumbra::server {

// Adds pieces; each is preceded by its length, so that no two lists of pieces look alike.
class Digest {
public:
    Digest();
    ~Digest();
    Digest(const Digest&) = delete;
    Digest& operator=(const Digest&) = delete;

    Digest& add(std::string_view piece);
    std::string hex(); // 64 digits; ends it

private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace penumbra::server
