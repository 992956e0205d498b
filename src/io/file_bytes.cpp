#include "file_bytes.h"

#include "cloud_readers.h"

#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>

namespace holdfast::io {
namespace {

bool
startsWith(std::string_view text, std::string_view start)
{
  return text.substr(0, start.size()) == start;
}

/// Standard input, a pipe: what has no size beforehand.
FileBytes
readStream(std::istream& stream)
{
  constexpr std::size_t kBlock = 1U << 20U;
  constexpr std::size_t kLimit = std::size_t{8} << 30U;
  FileBytes bytes;
  std::string& text = bytes.text;
  while (stream) {
    const std::size_t before = text.size();
    if (before > kLimit)
      throw std::runtime_error("more than 8 GiB do not come to an end");
    text.resize(before + kBlock);
    stream.read(&text[before], static_cast<std::streamsize>(kBlock));
    text.resize(before + static_cast<std::size_t>(stream.gcount()));
  }
  return bytes;
}

FileBytes
readRegular(const std::string& path, std::istream& file)
{
  FileBytes bytes;
  bytes.block_size = std::filesystem::file_size(path);
  bytes.block.reset(new char[bytes.block_size]);
  const auto size = static_cast<std::streamsize>(bytes.block_size);
  file.read(bytes.block.get(), size);
  if (file.gcount() != size)
    throw std::runtime_error("could not be read completely");
  return bytes;
}

FileBytes
readFile(const std::string& path, const std::string& wanted)
{
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_type type = fs::status(path, error).type();
  if (type == fs::file_type::not_found)
    throw std::runtime_error("no such file");
  if (type == fs::file_type::directory)
    throw std::runtime_error("is a directory, not " + wanted);
  if (type != fs::file_type::regular && type != fs::file_type::fifo)
    throw std::runtime_error("is not a regular file");
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw std::runtime_error("cannot be opened: " + std::string(std::strerror(errno)));
  return type == fs::file_type::fifo ? readStream(file) : readRegular(path, file);
}

} // namespace

FileBytes
readBytes(const std::string& path, const std::string& wanted)
{
  FileBytes bytes = path == "-" ? readStream(std::cin) : readFile(path, wanted);
  if (bytes.view().empty())
    throw std::runtime_error("is empty");
  return bytes;
}

std::optional<std::string_view>
nameOfStranger(std::string_view bytes)
{
  using namespace std::string_view_literals;
  struct Stranger {
    std::string_view start, name;
  };
  constexpr std::string_view kPage = "a web page, not the file itself";
  static constexpr Stranger kStrangers[]{
      {"version https://git-lfs"sv, "a Git LFS pointer, not the file itself"},
      {"/annex/objects/"sv, "a git-annex pointer, not the file itself"},
      {"../.git/annex/"sv, "a git-annex pointer, not the file itself"},
      {"\x1f\x8b"sv, "packed by gzip: unpack it first"},
      {"PK\x03\x04"sv, "packed by zip: unpack it first"},
      {"BZh"sv, "packed by bzip2: unpack it first"},
      {"\xfd\x37zXZ"sv, "packed by xz: unpack it first"},
      {"\x28\xb5\x2f\xfd"sv, "packed by zstd: unpack it first"},
      {"7z\xbc\xaf"sv, "packed by 7-zip: unpack it first"},
      {"\xff\xfe"sv, "text in UTF-16: save it as UTF-8"},
      {"\xfe\xff"sv, "text in UTF-16: save it as UTF-8"},
  };
  for (const Stranger& stranger : kStrangers)
    if (startsWith(bytes, stranger.start))
      return stranger.name;
  std::string start(skipToText(bytes).substr(0, 16));
  for (char& c : start)
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (startsWith(start, "<!doctype html") || startsWith(start, "<html") ||
      startsWith(start, "<head"))
    return kPage;
  if (startsWith(start, "<?xml"))
    return "XML, which is not read";
  return std::nullopt;
}

} // namespace holdfast::io
