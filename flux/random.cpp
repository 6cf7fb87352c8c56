#include "flux/random.hpp"

namespace sidewall::flux {

namespace {
constexpr std::uint64_t kFirst = 0xD2511F53u, kSecond = 0xCD9E8D57u;
}

alignas(32) const std::uint64_t kMultiplier[2][8] = {
    {kFirst, kFirst, kFirst, kFirst, kFirst, kFirst, kFirst, kFirst},
    {kSecond, kSecond, kSecond, kSecond, kSecond, kSecond, kSecond, kSecond}};

}  // namespace sidewall::flux
