//! KickBench: engines x robots x scenarios x seeds to one table.
