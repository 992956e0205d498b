/// \file Runs the built program and keeps what it said.
#pragma once

#include <sys/wait.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

namespace holdfast::test {

inline std::string
readFile(const std::string& path)
{
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline void
writeFile(const std::string& path, const std::string& bytes)
{
  // Some file systems wait for the disk when a file is emptied and filled again.
  std::filesystem::remove(path);
  std::ofstream(path, std::ios::binary) << bytes;
}

/// An empty folder of its own for one test.
inline std::string
freshFolder(const std::string& name)
{
  const auto folder = std::filesystem::path(HOLDFAST_SCRATCH_DIR) / name;
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder.string();
}

/// Names of the files in a folder, sorted.
inline std::vector<std::string>
filesIn(const std::string& folder)
{
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

struct ProgramRun {
  int exit_code = -1; ///< 128 + signal when it was killed
  std::string out;
  std::string err;

  /// Number of lines on standard error.
  int errorLines() const
  {
    return static_cast<int>(std::count(err.begin(), err.end(), '\n'));
  }
};

inline std::string
shellQuoted(const std::string& word)
{
  std::string quoted = "'";
  for (const char c : word)
    quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

/// Runs a program with arguments. \param folder where its standard error is kept
inline ProgramRun
runExecutable(const std::string& folder,
              const std::string& executable,
              const std::vector<std::string>& arguments)
{
  const std::string errors = folder + "/stderr.txt";
  std::string command = shellQuoted(executable);
  for (const std::string& argument : arguments)
    command += ' ' + shellQuoted(argument);
  command += " 2>" + shellQuoted(errors) + " </dev/null";
  FILE* pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr)
    throw std::runtime_error("cannot run " + command);
  ProgramRun run;
  char buffer[4096];
  for (std::size_t n = 0; (n = std::fread(buffer, 1, sizeof(buffer), pipe)) > 0;)
    run.out.append(buffer, n);
  const int status = ::pclose(pipe);
  run.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  run.err = readFile(errors);
  std::filesystem::remove(errors);
  return run;
}

/// Runs `holdfast ARGUMENTS...`.
inline ProgramRun
runProgram(const std::string& folder, const std::vector<std::string>& arguments)
{
  return runExecutable(folder, HOLDFAST_PROGRAM, arguments);
}

/// Runs a program of samples/.
inline ProgramRun
runSample(const std::string& folder,
          const std::string& name,
          const std::vector<std::string>& arguments)
{
  return runExecutable(folder, HOLDFAST_SAMPLES "/" + name, arguments);
}

/// A recorded cloud, or an empty string when there are none on this machine.
inline std::string
recordedCloud(const std::string& name)
{
  const char* folder = std::getenv("HOLDFAST_DATA_DIR");
  const std::string path =
      std::string(folder != nullptr ? folder : HOLDFAST_DATA_DIR) + "/" + name;
  return std::filesystem::exists(path) ? path : std::string();
}

} // namespace holdfast::test
