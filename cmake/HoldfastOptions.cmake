# What is built, and how. Nothing here reaches a program that uses the library.

option(HOLDFAST_BUILD_APPS "Build the program holdfast" ${PROJECT_IS_TOP_LEVEL})
option(HOLDFAST_BUILD_TESTS "Build the tests" ${PROJECT_IS_TOP_LEVEL})
option(HOLDFAST_BUILD_SAMPLES "Build the programs in samples/" ${PROJECT_IS_TOP_LEVEL})
option(HOLDFAST_BUILD_EXPERIMENTS "The sub-command holdfast experiment"
  ${PROJECT_IS_TOP_LEVEL})
option(HOLDFAST_QUICKSTART "Only what the first look needs; see HoldfastQuickstart" OFF)
include(HoldfastQuickstart)
# Named after PCL's own. Without them, templates for labelled points and points with
# normals are compiled by who uses them, with PCL_NO_PRECOMPILE.
option(HOLDFAST_ONLY_CORE_POINT_TYPES
  "Templates for XYZ, XYZI, XYZRGB, XYZRGBA, Normal and points with covariance only" OFF)
option(HOLDFAST_WERROR "Treat warnings as errors" OFF)
set(HOLDFAST_SANITIZE "" CACHE STRING "Sanitizers, e.g. address;undefined or thread")

# Shared by default, as PCL is. It is also the safer choice for programs built with
# -march=native: in a static library the linker would keep one copy of each Eigen
# template for both instruction sets, and their ideas of alignment differ.
option(BUILD_SHARED_LIBS "Build shared libraries" ON)

get_property(multi_config GLOBAL PROPERTY GENERATOR_IS_MULTI_CONFIG)
if(PROJECT_IS_TOP_LEVEL AND NOT multi_config AND NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()

set(CMAKE_CXX_STANDARD 17)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

if(HOLDFAST_SANITIZE)
  list(JOIN HOLDFAST_SANITIZE "," sanitizers)
  add_compile_options(
    -fsanitize=${sanitizers} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${sanitizers})
  # Else Eigen shifts its allocations under AddressSanitizer, and PCL, which is not built
  # with it, frees ours where they do not begin. The sanitizer's malloc is aligned.
  add_compile_definitions(EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()

# Warnings of one of our own targets. PCL's macros for members of point types are
# anonymous structs, which clang reports where they are used.
function(holdfast_set_warnings target)
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
    $<$<CXX_COMPILER_ID:Clang,AppleClang>:-Wno-gnu-anonymous-struct>
    $<$<CXX_COMPILER_ID:Clang,AppleClang>:-Wno-nested-anon-types>
    $<$<BOOL:${HOLDFAST_WERROR}>:-Werror>)
endfunction()

# Most of a source file's compile time goes into the headers of PCL, Eigen and CLI11.
# A compiler cache finds nothing again behind a precompiled header unless it is told to
# be sloppy, so the default is one or the other.
if(CMAKE_CXX_COMPILER_LAUNCHER)
  set(precompile OFF)
else()
  set(precompile ON)
endif()
option(HOLDFAST_PRECOMPILE_HEADERS "Compile common headers once per target" ${precompile})

# holdfast_precompile(TARGET header...) or (TARGET REUSE_FROM other).
function(holdfast_precompile target)
  if(NOT HOLDFAST_PRECOMPILE_HEADERS)
    return()
  endif()
  if(ARGV1 STREQUAL REUSE_FROM)
    target_precompile_headers(${target} REUSE_FROM ${ARGV2})
  else()
    target_precompile_headers(${target} PRIVATE ${ARGN})
  endif()
endfunction()
