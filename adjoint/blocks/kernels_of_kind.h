// The kernels of one kind in direct blocks, for explicit instantiation: `where` is empty or `extern`.
#pragma once

#include "adjoint/blocks/block_reverse.h"
#include "core/blocks/block_tangents.h"

#define SHEETBEND_BLOCK_KERNELS_OVER(where, K, T)                                                         \
  where template void evaluate_run<K, T>(const sheetbend_blocks::Block&, const sheetbend_blocks::Run&);   \
  where template void values_of_run<K, T>(const sheetbend_blocks::Values&, const sheetbend_blocks::Run&); \
  where template void refer_run<K, T>(const sheetbend_blocks::References&, const sheetbend_blocks::Run&); \
  where template void pull_back_run<K, T>(const sheetbend_blocks::Block&, const sheetbend_blocks::Run&);  \
  where template void values_of_run_vjp<K, T>(const sheetbend_blocks::Values&, const sheetbend_blocks::Run&);

#define SHEETBEND_BLOCK_KERNELS(where, K)                                                                         \
  SHEETBEND_BLOCK_KERNELS_OVER(where, K, double)                                                                  \
  SHEETBEND_BLOCK_KERNELS_OVER(where, K, Pack)                                                                    \
  where template void tangents_of_run<K>(const sheetbend_blocks::Block&, const sheetbend_blocks::Tangents&, int); \
  where template void values_tangents_of_run<K>(const sheetbend_blocks::Values&,                                  \
                                                const sheetbend_blocks::ValueTangents&, int);
