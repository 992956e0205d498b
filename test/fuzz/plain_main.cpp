/// \file Runs a fuzz target without libFuzzer: over the files of its corpus, then over
/// mutations of them, the same for the same seed.
///
///     fuzz_pcd CORPUS [MUTATIONS [SEED]]
#include "fuzz.h"

#include <fcntl.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

namespace {

using Input = std::vector<std::uint8_t>;

constexpr std::size_t kLargest = 16384; // bytes
constexpr unsigned kPatience = 30; // seconds for one input

const Input* running = nullptr;

/// Keeps the input that ended the program. Calls nothing that a signal may not.
void
keepInput(int signal)
{
  std::signal(signal, SIG_DFL);
  const int file = open("fuzz-finding", O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file >= 0 && running != nullptr) {
    const ssize_t written = write(file, running->data(), running->size());
    constexpr std::array kNote{"the input is in the file fuzz-finding\n",
                               "the input could not be kept\n"};
    const bool kept = written == static_cast<ssize_t>(running->size());
    const char* note = kNote[kept ? 0 : 1];
    if (write(STDERR_FILENO, note, std::strlen(note)) < 0)
      _exit(1);
  }
  raise(signal);
}

void
run(const Input& input)
{
  running = &input;
  alarm(kPatience);
  LLVMFuzzerTestOneInput(input.data(), input.size());
  alarm(0);
  running = nullptr;
}

std::vector<Input>
readCorpus(const std::string& folder)
{
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.is_regular_file())
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<Input> corpus;
  for (const auto& path : files) {
    std::ifstream file(path, std::ios::binary);
    corpus.emplace_back(std::istreambuf_iterator<char>(file),
                        std::istreambuf_iterator<char>());
  }
  return corpus;
}

class Mutator {
public:
  Mutator(const std::vector<Input>& corpus, std::uint64_t seed)
  : corpus_(corpus), random_(seed)
  {}

  Input next()
  {
    Input input = corpus_[below(corpus_.size())];
    for (std::size_t changes = 1 + below(6); changes > 0; --changes)
      change(input);
    if (input.size() > kLargest)
      input.resize(kLargest);
    return input;
  }

private:
  /// 0 to n - 1, and 0 for n = 0. Not by a distribution, whose results the standard
  /// leaves open.
  std::size_t below(std::size_t n)
  {
    return n == 0 ? 0 : static_cast<std::size_t>(random_() % n);
  }

  auto place(Input& input, std::size_t offset)
  {
    return input.begin() + static_cast<std::ptrdiff_t>(offset);
  }

  void change(Input& input)
  {
    const std::size_t kind = below(8);
    if (input.empty() || kind == 0)
      return splice(input);
    const std::size_t at = below(input.size());
    const std::size_t length = 1 + below(std::min<std::size_t>(64, input.size() - at));
    switch (kind) {
    case 1:
      input[at] ^= static_cast<std::uint8_t>(1U << below(8));
      break;
    case 2:
      input[at] = static_cast<std::uint8_t>(below(256));
      break;
    case 3:
      input.erase(place(input, at), place(input, at + length));
      break;
    case 4: { // twice
      const Input chunk(place(input, at), place(input, at + length));
      input.insert(place(input, at), chunk.begin(), chunk.end());
      break;
    }
    case 5: { // over another place
      const Input chunk(place(input, at), place(input, at + length));
      const std::size_t to = below(input.size() - length + 1);
      std::copy(chunk.begin(), chunk.end(), place(input, to));
      break;
    }
    case 6:
      putNumber(input, at);
      break;
    default: // rarely, as little is left to go wrong
      if (below(4) == 0)
        input.resize(at);
    }
  }

  /// The start of this and the end of another file.
  void splice(Input& input)
  {
    const Input& other = corpus_[below(corpus_.size())];
    input.resize(below(input.size() + 1));
    const std::size_t from = below(other.size() + 1);
    input.insert(input.end(),
                 other.begin() + static_cast<std::ptrdiff_t>(from),
                 other.end());
  }

  /// A number at the edge of a type: as text over a number in text, else as bytes.
  void putNumber(Input& input, std::size_t at)
  {
    static constexpr std::array kNumbers{"0",
                                         "-1",
                                         "127",
                                         "256",
                                         "65535",
                                         "65536",
                                         "2147483647",
                                         "2147483648",
                                         "4294967295",
                                         "4294967296",
                                         "9223372036854775807",
                                         "18446744073709551615",
                                         "1e308",
                                         "-1e-320",
                                         "1e999",
                                         "nan",
                                         "inf"};
    const std::string text = kNumbers[below(kNumbers.size())];
    const auto is_digit = [](std::uint8_t c) { return c >= '0' && c <= '9'; };
    if (is_digit(input[at])) {
      const auto end = std::find_if_not(place(input, at), input.end(), is_digit);
      const auto rest = input.erase(place(input, at), end);
      input.insert(rest, text.begin(), text.end());
      return;
    }
    const std::uint64_t value = std::uint64_t{0} - below(2) + (below(3) << below(64));
    const std::size_t bytes =
        std::min<std::size_t>(std::size_t{1} << below(4), input.size() - at);
    const bool big_endian = below(2) == 1;
    for (std::size_t i = 0; i < bytes; ++i) {
      const std::size_t byte = big_endian ? bytes - 1 - i : i;
      input[at + i] = static_cast<std::uint8_t>(value >> (8 * byte));
    }
  }

  const std::vector<Input>& corpus_;
  std::mt19937_64 random_;
};

} // namespace

int
main(int argc, char** argv)
{
  if (argc < 2 || argc > 4) {
    std::fprintf(stderr, "usage: %s CORPUS [MUTATIONS [SEED]]\n", argv[0]);
    return 2;
  }
  const unsigned long mutations = argc > 2 ? std::stoul(argv[2]) : 20000;
  const std::uint64_t seed = argc > 3 ? std::stoull(argv[3]) : 1;
  const std::vector<Input> corpus = readCorpus(argv[1]);
  if (corpus.empty()) {
    std::fprintf(stderr, "%s: has no files\n", argv[1]);
    return 1;
  }
  for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGALRM})
    std::signal(signal, keepInput);
  std::printf("%zu files, %lu mutations, seed %llu\n",
              corpus.size(),
              mutations,
              static_cast<unsigned long long>(seed));
  std::fflush(stdout);
  for (const Input& input : corpus)
    run(input);
  Mutator mutator(corpus, seed);
  for (unsigned long i = 0; i < mutations; ++i)
    run(mutator.next());
  return 0;
}
