"""Labels do not depend on what they are computed beside."""

import numpy as np

from training.labelling import critical_kappa
from training.reference_space import reference_sample


def test_cases_labelled_together_have_the_labels_they_have_alone():
    # Among these a step of the sweep once met an eigenvalue to the last bit, and ended the whole batch.
    cases = reference_sample(2000, seed=209756645316641).cases[256:384]
    together = critical_kappa(cases, workers=1)
    alone = [critical_kappa(cases[i : i + 1], workers=1)[0] for i in range(0, len(cases), 8)]
    np.testing.assert_allclose(together[::8], alone, rtol=1e-9)
