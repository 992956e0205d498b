// Output files: whole or not at all, whatever else is in their folder.
#include <holdfast/io/atomic_file.h>

#include "support/run_program.h"

#include <gtest/gtest.h>

#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <functional>
#include <thread>

namespace holdfast { namespace {

namespace fs = std::filesystem;
using test::filesIn;
using test::freshFolder;
using test::readFile;
using Names = std::vector<std::string>;

/// As src/io names them.
std::string
partial(const std::string& path, int n)
{
  return path + ".holdfast-partial-" + std::to_string(n);
}

void
write(const std::string& path, const std::string& text)
{
  AtomicFile file(path);
  file.stream() << text;
  file.commit();
}

std::string
errorOf(const std::function<void()>& work)
{
  try {
    work();
  }
  catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

unsigned
modeOf(const std::string& path)
{
  struct stat file {};
  EXPECT_EQ(::lstat(path.c_str(), &file), 0) << path;
  return file.st_mode & 07777U;
}

/// Another process that has begun to write a file.
class Writer {
public:
  explicit Writer(const std::string& path, void (*on_termination)(int) = nullptr)
  {
    int ready[2];
    if (::pipe(ready) != 0)
      throw std::runtime_error("no pipe");
    child_ = ::fork();
    if (child_ == 0) {
      if (on_termination != nullptr)
        std::signal(SIGTERM, on_termination);
      AtomicFile file(path);
      file.stream() << "unfinished" << std::flush;
      if (::write(ready[1], "x", 1) == 1)
        ::pause(); // to be ended by a signal
      ::_exit(2);
    }
    char byte = 0;
    EXPECT_EQ(::read(ready[0], &byte, 1), 1);
    ::close(ready[0]);
    ::close(ready[1]);
  }
  ~Writer()
  {
    if (child_ > 0)
      end(SIGKILL);
  }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  int end(int signal)
  {
    int status = 0;
    ::kill(child_, signal);
    ::waitpid(child_, &status, 0);
    child_ = 0;
    return status;
  }

private:
  pid_t child_ = 0;
};

TEST(AtomicFile, WritersOfOneFileDoNotMix)
{
  const std::string folder = freshFolder("atomic_writers");
  const std::string path = folder + "/result";
  {
    AtomicFile first(path), second(path);
    first.stream() << std::string(100000, 'a') << std::flush;
    second.stream() << std::string(100000, 'b') << std::flush;
    first.stream() << std::string(100000, 'a');
    second.commit();
    EXPECT_EQ(readFile(path), std::string(100000, 'b'));
    first.commit();
    EXPECT_EQ(readFile(path), std::string(200000, 'a'));
  }
  std::vector<std::thread> threads;
  for (char letter = 'a'; letter < 'i'; ++letter)
    threads.emplace_back([&path, letter] {
      for (int i = 0; i < 20; ++i)
        write(path, std::string(70000, letter));
    });
  for (std::thread& thread : threads)
    thread.join();
  const std::string last = readFile(path);
  EXPECT_EQ(last, std::string(70000, last.at(0)));
  EXPECT_EQ(filesIn(folder), Names{"result"});
}

TEST(AtomicFile, NothingAtTheTemporaryNameIsWrittenTo)
{
  const std::string folder = freshFolder("atomic_planted");
  const std::string path = folder + "/result", victim = folder + "/victim";
  test::writeFile(victim, "precious");
  fs::create_symlink(victim, partial(path, 0));
  fs::create_symlink(folder + "/nowhere", partial(path, 1));
  fs::create_directory(partial(path, 2));
  write(path, "text");
  EXPECT_EQ(readFile(path), "text");
  EXPECT_FALSE(fs::is_symlink(path));
  EXPECT_EQ(readFile(victim), "precious");
  EXPECT_EQ(filesIn(folder),
            (Names{"result",
                   "result.holdfast-partial-0",
                   "result.holdfast-partial-1",
                   "result.holdfast-partial-2",
                   "victim"}));
}

TEST(AtomicFile, LinksStayLinks)
{
  const std::string folder = freshFolder("atomic_links");
  fs::create_directories(folder + "/below");
  test::writeFile(folder + "/below/old", "old");
  fs::create_symlink("below/old", folder + "/relative");
  fs::create_symlink(folder + "/relative", folder + "/chain");
  fs::create_symlink("below/new", folder + "/dangling");
  fs::create_symlink("loop", folder + "/loop");
  write(folder + "/chain", "first");
  EXPECT_EQ(readFile(folder + "/below/old"), "first");
  write(folder + "/dangling", "second");
  EXPECT_EQ(readFile(folder + "/below/new"), "second");
  for (const char* link : {"/relative", "/chain", "/dangling"})
    EXPECT_TRUE(fs::is_symlink(folder + link)) << link;
  EXPECT_EQ(errorOf([&] { AtomicFile{folder + "/loop"}; }),
            folder + "/loop: cannot be written: Too many levels of symbolic links");
  EXPECT_EQ(filesIn(folder + "/below"), (Names{"new", "old"}));
}

TEST(AtomicFile, PermissionsOfTheReplacedFileStay)
{
  const std::string folder = freshFolder("atomic_modes");
  const std::string path = folder + "/result";
  for (const unsigned mode : {0600U, 0640U, 0664U, 0755U}) {
    test::writeFile(path, "old");
    ::chmod(path.c_str(), mode);
    AtomicFile file(path);
    EXPECT_EQ(modeOf(partial(path, 0)), 0600U);
    file.stream() << "new";
    file.commit();
    EXPECT_EQ(modeOf(path), mode);
    EXPECT_EQ(readFile(path), "new");
  }
  const mode_t mask = ::umask(027);
  write(folder + "/fresh", "text");
  ::umask(mask);
  EXPECT_EQ(modeOf(folder + "/fresh"), 0640U);
}

TEST(AtomicFile, NamesOfAnyLength)
{
  const std::string folder = freshFolder("atomic_names");
  for (const std::string letter : {"x", "\xc3\xa4", "\xe2\x82\xac"})
    for (const std::size_t size : {1UL, 200UL, 231UL, 240UL, 250UL, 255UL}) {
      std::string name;
      while (name.size() + letter.size() <= size)
        name += letter;
      if (name.empty())
        continue;
      AtomicFile file(folder + "/" + name);
      AtomicFile other(folder + "/" + name);
      file.stream() << name;
      file.commit();
      EXPECT_EQ(readFile(folder + "/" + name), name);
    }
  for (const std::string& name : filesIn(folder))
    EXPECT_EQ(name.find("partial"), std::string::npos) << name;
  const std::string long_name = folder + "/" + std::string(256, 'x');
  EXPECT_EQ(errorOf([&] { write(long_name, "text"); }),
            long_name + ": cannot be written: File name too long");
  EXPECT_NE(errorOf([&] { write("", "text"); }), "");
  EXPECT_NE(errorOf([&] { write(folder + "/none/", "text"); }), "");
}

TEST(AtomicFile, WhatKilledWritersLeftIsRemoved)
{
  const std::string folder = freshFolder("atomic_leftovers");
  const std::string path = folder + "/result";
  Writer living(path), doomed(path), other(folder + "/other");
  doomed.end(SIGKILL);
  other.end(SIGKILL);
  EXPECT_EQ(filesIn(folder).size(), 3U);
  write(path, "text");
  EXPECT_EQ(filesIn(folder),
            (Names{"other.holdfast-partial-0", "result", "result.holdfast-partial-0"}));
  living.end(SIGKILL);
  write(path, "text");
  write(folder + "/other", "text");
  EXPECT_EQ(filesIn(folder), (Names{"other", "result"}));
}

TEST(AtomicFile, SignalHandlersCanRemoveThemAll)
{
  const std::string folder = freshFolder("atomic_signal");
  test::writeFile(folder + "/result", "old");
  Writer writer(folder + "/result", [](int) {
    removeTemporaryFiles();
    ::_exit(0);
  });
  EXPECT_EQ(filesIn(folder).size(), 2U);
  EXPECT_EQ(writer.end(SIGTERM), 0);
  EXPECT_EQ(filesIn(folder), Names{"result"});
  EXPECT_EQ(readFile(folder + "/result"), "old");
}

TEST(AtomicFile, ALimitOnFilesIsNamedAndNothingIsLeft)
{
  const std::string folder = freshFolder("atomic_limit");
  rlimit old{};
  ::getrlimit(RLIMIT_FSIZE, &old);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit low{1000, old.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &low), 0);
  const std::string error =
      errorOf([&] { write(folder + "/result", std::string(300000, 'x')); });
  ::setrlimit(RLIMIT_FSIZE, &old);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(error, folder + "/result: cannot be written: File too large");
  EXPECT_EQ(filesIn(folder), Names{});
}

TEST(AtomicFile, FilesThatBelongTogetherAppearTogether)
{
  const std::string folder = freshFolder("atomic_together");
  AtomicFile good(folder + "/good"), bad("/dev/full");
  good.stream() << "text";
  bad.stream() << "text";
  EXPECT_EQ(errorOf([&] {
              AtomicFile::commit(std::vector{&good, &bad});
            }),
            "/dev/full: cannot be written: No space left on device");
  EXPECT_FALSE(fs::exists(folder + "/good"));
  good.commit();
  EXPECT_EQ(readFile(folder + "/good"), "text");
}

}} // namespace holdfast
