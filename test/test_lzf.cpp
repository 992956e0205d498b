// Our own LZF, beside PCL's: each unpacks what the other packs, and nothing broken is
// taken.
#include "io/lzf.h"

#include "support/random.h"

#include <pcl/io/lzf.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace holdfast::io { namespace {

/// Bytes with runs, repetitions near and far, and noise, in random shares.
std::string
someBytes(test::Random& random)
{
  std::string bytes;
  const int pieces = random.integer(0, 60);
  for (int piece = 0; piece < pieces; ++piece) {
    const auto n = static_cast<std::size_t>(random.integer(1, 700));
    const int kind = random.integer(0, 2);
    if (kind == 0)
      bytes.append(n, static_cast<char>(random.integer(0, 255)));
    else if (kind == 1 && !bytes.empty()) {
      const auto back = static_cast<std::size_t>(random.integer(1, 9000));
      const std::size_t from = bytes.size() - std::min(back, bytes.size());
      for (std::size_t i = 0; i < n; ++i)
        bytes += bytes[from + i];
    }
    else
      for (std::size_t i = 0; i < n; ++i)
        bytes += static_cast<char>(random.integer(0, 255));
  }
  return bytes;
}

/// As unpacked into memory of exactly this size, so that sanitizers see a byte too
/// many.
std::pair<bool, std::string>
unpacked(std::string_view packed, std::size_t size)
{
  const std::vector<char> exact(packed.begin(), packed.end());
  std::vector<char> plain(size);
  const bool good = lzfDecompress({exact.data(), exact.size()}, plain.data(), size);
  return {good, std::string(plain.begin(), plain.end())};
}

TEST(Lzf, PackedBytesComeBack)
{
  for (std::uint64_t i = 0; i < 300; ++i) {
    test::Random random(i);
    const std::string bytes = someBytes(random);
    const std::string packed = lzfCompress(bytes);
    EXPECT_EQ(unpacked(packed, bytes.size()), std::make_pair(true, bytes));
    EXPECT_LE(packed.size(), bytes.size() + bytes.size() / 32 + 1);
  }
}

TEST(Lzf, RepetitionsArePacked)
{
  EXPECT_LT(lzfCompress(std::string(100000, 'a')).size(), 2000U);
  std::string words;
  for (int i = 0; i < 1000; ++i)
    words += "one two three ";
  EXPECT_LT(lzfCompress(words).size(), words.size() / 50);
}

TEST(Lzf, PclUnpacksOurs)
{
  for (std::uint64_t i = 0; i < 100; ++i) {
    test::Random random(i);
    const std::string bytes = someBytes(random) + '.';
    const std::string packed = lzfCompress(bytes);
    std::string plain(bytes.size(), '\0');
    const auto n = pcl::lzfDecompress(packed.data(),
                                      static_cast<unsigned int>(packed.size()),
                                      plain.data(),
                                      static_cast<unsigned int>(plain.size()));
    EXPECT_EQ(n, plain.size());
    EXPECT_EQ(plain, bytes);
  }
}

TEST(Lzf, OursUnpacksPcls)
{
  for (std::uint64_t i = 0; i < 100; ++i) {
    test::Random random(i);
    const std::string bytes = someBytes(random) + "a word, a word, a word";
    std::string packed(2 * bytes.size() + 100, '\0');
    packed.resize(pcl::lzfCompress(bytes.data(),
                                   static_cast<unsigned int>(bytes.size()),
                                   packed.data(),
                                   static_cast<unsigned int>(packed.size())));
    ASSERT_FALSE(packed.empty());
    EXPECT_EQ(unpacked(packed, bytes.size()), std::make_pair(true, bytes));
  }
}

// Whatever the bytes: an answer, and as sanitizers can tell no byte beside the two
// ranges.
TEST(Lzf, BrokenStreamsAreRefusedOrFit)
{
  int refused = 0;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    test::Random random(i);
    const std::string bytes = someBytes(random) + "some more";
    std::string packed = lzfCompress(bytes);
    for (int k = random.integer(1, 4); k > 0; --k)
      packed[static_cast<std::size_t>(
          random.integer(0, static_cast<int>(packed.size()) - 1))] =
          static_cast<char>(random.integer(0, 255));
    refused += !unpacked(packed, bytes.size()).first;
  }
  EXPECT_GT(refused, 100);
}

TEST(Lzf, CutStreamsAndOtherSizesAreRefused)
{
  test::Random random;
  const std::string bytes =
      someBytes(random) + "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa";
  const std::string packed = lzfCompress(bytes);
  for (std::size_t n = 0; n < packed.size(); ++n)
    EXPECT_FALSE(unpacked({packed.data(), n}, bytes.size()).first) << n;
  EXPECT_FALSE(unpacked(packed, bytes.size() + 1).first);
  EXPECT_FALSE(unpacked(packed, bytes.size() - 1).first);
}

}} // namespace holdfast::io
