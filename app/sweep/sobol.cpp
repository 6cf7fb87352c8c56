#include "app/sweep/sobol.hpp"

#include <array>

namespace sidewall::app {
namespace {

constexpr unsigned kBits = 32;

// Degree and inner coefficients of a primitive polynomial, and the first direction numbers.
struct Direction {
    unsigned degree;
    std::uint32_t coefficients;
    std::array<std::uint32_t, 5> first;
};

constexpr std::array<Direction, kSobolDimensions - 1> kDirections{{{1, 0, {1}},
                                                                   {2, 1, {1, 3}},
                                                                   {3, 1, {1, 3, 1}},
                                                                   {3, 2, {1, 1, 1}},
                                                                   {4, 1, {1, 1, 3, 3}},
                                                                   {4, 4, {1, 3, 5, 13}},
                                                                   {5, 2, {1, 1, 5, 5, 17}},
                                                                   {5, 4, {1, 1, 5, 5, 5}},
                                                                   {5, 7, {1, 1, 7, 11, 19}}}};

// Where bit k of the index flips the coordinate: v_k = m_k / 2^(k+1) as a binary fraction.
std::array<std::uint32_t, kBits> direction_vectors(std::size_t dimension) {
    std::array<std::uint32_t, kBits> v{};
    if (dimension == 0) {
        for (unsigned k = 0; k < kBits; ++k) v[k] = 1u << (kBits - 1 - k);
        return v;
    }
    const Direction& d = kDirections[dimension - 1];
    for (unsigned k = 0; k < kBits; ++k) {
        if (k < d.degree) {
            v[k] = d.first[k] << (kBits - 1 - k);
            continue;
        }
        v[k] = v[k - d.degree] ^ v[k - d.degree] >> d.degree;
        for (unsigned i = 1; i < d.degree; ++i)
            if ((d.coefficients >> (d.degree - 1 - i) & 1u) != 0) v[k] ^= v[k - i];
    }
    return v;
}

}  // namespace

double sobol(std::uint32_t index, std::size_t dimension) {
    const auto v = direction_vectors(dimension);
    const std::uint32_t gray = index ^ index >> 1;
    std::uint32_t x = 0;
    for (unsigned k = 0; k < kBits; ++k)
        if ((gray >> k & 1u) != 0) x ^= v[k];
    return static_cast<double>(x) * 0x1p-32;
}

}  // namespace sidewall::app
