# AddressSanitizer (with LeakSanitizer) and UBSan under the same tests: the floors are compiled once more with them, and the tests' objects are linked to these.
# By clang where it is there, which compiles in half the time and makes the tests run faster.
set(compiled_by_clang CXX_EXTENSIONS OFF)  # as everywhere
find_program(UNRIG_CLANG clang++)
if(UNRIG_CLANG)
  file(CONFIGURE OUTPUT nothing.cpp CONTENT "int main() {}\n")
  execute_process(COMMAND ${UNRIG_CLANG} -fsanitize=address,undefined ${CMAKE_CURRENT_BINARY_DIR}/nothing.cpp -o ${CMAKE_CURRENT_BINARY_DIR}/nothing RESULT_VARIABLE without_runtime ERROR_QUIET)
endif()
if(UNRIG_CLANG AND NOT without_runtime)
  set(by_clang ${CMAKE_CURRENT_BINARY_DIR}/by_clang.sh)
  list(JOIN CMAKE_CXX_COMPILER_LAUNCHER " " launcher)
  file(CONFIGURE OUTPUT ${by_clang} CONTENT "#!/bin/sh\n# In place of the compiler, which is the first word.\nshift\nexec @launcher@ @UNRIG_CLANG@ \"$@\"\n" @ONLY)
  file(CHMOD ${by_clang} PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE)
  set(compiled_by_clang CXX_COMPILER_LAUNCHER ${by_clang} CXX_LINKER_LAUNCHER ${by_clang})
endif()
set(unrig_sanitizers -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer -O1 -g1 -UNDEBUG
  # Eigen takes its memory as in the tests' objects and in Debian's Ceres; else it would pad what AddressSanitizer watches.
  -DEIGEN_MALLOC_ALREADY_ALIGNED=1)
# What of UBSan looks at every pointer costs more than all other checks together, and AddressSanitizer looks at what is read there: only the readers of files have it.
set(careless_of_pointers -fno-sanitize=null,alignment,pointer-overflow,object-size)
set(careful_of_pointers -fsanitize=null,alignment,pointer-overflow,object-size)
# AddressSanitizer alone, and optimised: with all checks two thirds of a diagnosis went by in them.
set(kernel -O3 -fno-sanitize=undefined)
# How they are started (a list of variables in a test's ENVIRONMENT does not survive gtest_discover_tests).
set(in_this_environment env LSAN_OPTIONS=suppressions=${CMAKE_CURRENT_SOURCE_DIR}/known_leaks.txt:print_suppressions=0 ASAN_OPTIONS=malloc_context_size=8:quarantine_size_mb=16 UBSAN_OPTIONS=print_stacktrace=1
  UNRIG_TESTED_BINARY=${CMAKE_CURRENT_BINARY_DIR}/sanitised_unrig sh ${CMAKE_CURRENT_SOURCE_DIR}/for_a_while.sh)

set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS fuzz/sources.txt)
file(STRINGS fuzz/sources.txt careful)
list(APPEND careful core/run/run_text.cpp core/import/import.cpp)
list(TRANSFORM careful PREPEND ${PROJECT_SOURCE_DIR}/)
set_source_files_properties(${careful} PROPERTIES SKIP_PRECOMPILE_HEADERS ON COMPILE_OPTIONS "${careful_of_pointers}")
# As in the floors' own lists: source properties hold in one directory.
set(kernels ${PROJECT_SOURCE_DIR}/core/numerics/product ${PROJECT_SOURCE_DIR}/core/numerics/small_product ${PROJECT_SOURCE_DIR}/core/numerics/householder ${PROJECT_SOURCE_DIR}/core/numerics/triangularise)
list(TRANSFORM kernels APPEND .cpp OUTPUT_VARIABLE chosen)
list(TRANSFORM kernels APPEND _avx2.cpp OUTPUT_VARIABLE wide)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  set_source_files_properties(${wide} PROPERTIES SKIP_PRECOMPILE_HEADERS ON COMPILE_OPTIONS "${kernel};${unrig_wide_vectors}")
  set_source_files_properties(${PROJECT_SOURCE_DIR}/core/numerics/triangularise_avx2.cpp ${PROJECT_SOURCE_DIR}/core/numerics/product_avx2.cpp PROPERTIES COMPILE_OPTIONS "${kernel};${unrig_wide_vectors_rounded}")
  set_source_files_properties(${chosen} PROPERTIES SKIP_PRECOMPILE_HEADERS ON COMPILE_OPTIONS "${kernel}" COMPILE_DEFINITIONS UNRIG_WIDE_VECTORS)
else()
  set_source_files_properties(${wide} PROPERTIES HEADER_FILE_ONLY ON)
endif()

add_library(unrig_sanitizers INTERFACE)
target_compile_options(unrig_sanitizers INTERFACE ${unrig_sanitizers} ${careless_of_pointers})
target_compile_definitions(unrig_sanitizers INTERFACE UNRIG_VERSION="${PROJECT_VERSION}")
target_link_options(unrig_sanitizers INTERFACE -fsanitize=address,undefined)

# sanitised_core is unrig_core again, and so on; each floor stands on its like.
foreach(floor core fit correct)
  get_target_property(sources unrig_${floor} SOURCES)
  get_target_property(below unrig_${floor} LINK_LIBRARIES)
  list(TRANSFORM below REPLACE "^unrig_(core|fit|correct)$" "sanitised_\\1")
  list(FILTER below EXCLUDE REGEX "unrig_warnings")  # the floors themselves are compiled with warnings
  add_library(sanitised_${floor} STATIC ${sources})
  add_dependencies(sanitised_${floor} unrig_${floor})  # which makes the page of the report
  set_target_properties(sanitised_${floor} PROPERTIES UNITY_BUILD ${floors_in_unity} ${compiled_by_clang})
  target_precompile_headers(sanitised_${floor} PRIVATE precompiled.h)
  target_include_directories(sanitised_${floor} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(sanitised_${floor} PUBLIC ${below} unrig_sanitizers)
endforeach()
add_executable(sanitised_unrig ${PROJECT_SOURCE_DIR}/correct/main.cpp)
target_link_libraries(sanitised_unrig PRIVATE sanitised_correct CLI11::CLI11)
set_target_properties(sanitised_unrig PROPERTIES ${compiled_by_clang})

# The same tests, called sanitised.core.* and so on, but for what is left out, by name as --gtest_filter takes it.
set(left_out Lengths.AMillionSamplesFitIntoASixthOfAGigabyte  # memory under AddressSanitizer is another
  Fit.OfARecordWithoutNoiseConverges)  # its last steps are rounding, which is another too
list(JOIN left_out ":" left_out)
# Whole searches, minutes each: begun when all others are done, so that a machine whose time runs out has seen everything else.
set(longest Diagnose.* Selection.* LongSelection.* DiagnosedRecordings.* DecaysFirst.* RunInLegs.AreForLinearRigs Check.NamesCauseAndRunOfEveryMistakeInOneRun)
list(JOIN longest ":" longest)
foreach(folder core fit correct verification commands)
  get_target_property(libraries test_${folder} LINK_LIBRARIES)
  list(TRANSFORM libraries REPLACE "^unrig_(core|fit|correct)$" "sanitised_\\1")
  get_target_property(objects test_${folder} SOURCES)
  # The floors come first: of a template that both have the linker keeps the first, and the tests' own is without sanitizers.
  set(first ${libraries})
  list(FILTER first INCLUDE REGEX "^sanitised_")
  if("sanitised_correct" IN_LIST first OR "sanitised_fit" IN_LIST first)
    list(APPEND first sanitised_fit sanitised_core)
  endif()
  list(REMOVE_DUPLICATES first)
  list(TRANSFORM first REPLACE "(.+)" "$<TARGET_OBJECTS:\\1>")
  add_executable(sanitised_test_${folder} ${first} ${objects})
  target_link_libraries(sanitised_test_${folder} PRIVATE ${libraries} unrig_sanitizers)
  set_target_properties(sanitised_test_${folder} PROPERTIES CROSSCOMPILING_EMULATOR "${in_this_environment}" ${compiled_by_clang})
  list(FIND from_short_to_long ${folder} cost)
  math(EXPR cost "10 - ${cost}")
  gtest_discover_tests(sanitised_test_${folder} TEST_PREFIX sanitised.${folder}. TEST_FILTER "-${left_out}:${longest}" DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 9000 COST ${cost})
  gtest_discover_tests(sanitised_test_${folder} TEST_PREFIX sanitised.${folder}. TEST_FILTER "${longest}" TEST_LIST sanitised_longest_${folder} DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 9000 COST 0)
endforeach()
add_dependencies(sanitised_test_commands sanitised_unrig)

foreach(study coverage basin correct effects)
  add_executable(sanitised_${study}_study $<TARGET_OBJECTS:sanitised_correct> $<TARGET_OBJECTS:sanitised_fit> $<TARGET_OBJECTS:sanitised_core>
    $<TARGET_OBJECTS:${study}_study_objects> $<TARGET_OBJECTS:unrig_study_parts>)
  target_link_libraries(sanitised_${study}_study PRIVATE sanitised_correct unrig_test_support Threads::Threads)
  set_target_properties(sanitised_${study}_study PROPERTIES CROSSCOMPILING_EMULATOR "${in_this_environment}" ${compiled_by_clang})
  add_test(NAME sanitised.studies.${study} COMMAND sanitised_${study}_study ${${study}_study_arguments})
  set_tests_properties(sanitised.studies.${study} PROPERTIES SKIP_REGULAR_EXPRESSION "\\[  SKIPPED \\]" TIMEOUT 9000 COST 1)
endforeach()

# The readers of files on the corpora of their fuzzers (fuzz/README.md).
add_library(unrig_replay OBJECT fuzz/replay.cpp)
set_target_properties(unrig_replay PROPERTIES ${compiled_by_clang})
target_link_libraries(unrig_replay PUBLIC sanitised_core)
foreach(reader run rig law tdms uff mat text)
  add_executable(replay_${reader} fuzz/fuzz_${reader}.cpp)
  target_link_libraries(replay_${reader} PRIVATE unrig_replay)
  set_target_properties(replay_${reader} PROPERTIES CROSSCOMPILING_EMULATOR "${in_this_environment}" ${compiled_by_clang})
  add_test(NAME sanitised.corpus.${reader} COMMAND replay_${reader} ${CMAKE_CURRENT_SOURCE_DIR}/fuzz/corpus/${reader})
  set_tests_properties(sanitised.corpus.${reader} PROPERTIES SKIP_REGULAR_EXPRESSION "\\[  SKIPPED \\]" TIMEOUT 9000 COST 10)
endforeach()
