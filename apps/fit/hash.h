/// \file A hash that is the same on every machine and in every version.
#pragma once

#include <cstdint>
#include <string_view>

namespace holdfast::app {

/// FNV-1a with the finalizer of MurmurHash3: 64 bits of which any may be used.
constexpr std::uint64_t
stableHash(std::string_view text)
{
  std::uint64_t h = 0xcbf29ce484222325;
  for (const char c : text) {
    h ^= static_cast<unsigned char>(c);
    h *= 0x100000001b3;
  }
  h ^= h >> 33;
  h *= 0xff51afd7ed558ccd;
  h ^= h >> 33;
  h *= 0xc4ceb9fe1a85ec53;
  return h ^ (h >> 33);
}

} // namespace holdfast::app
