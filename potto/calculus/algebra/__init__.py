"""Terms as algebra: normal forms, polynomials, affine maps, the values that terms can take."""
