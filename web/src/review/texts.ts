/** What the review page says, in the language that was chosen before it was loaded. */

import { reviewTexts as others, type ReviewTexts } from "../texts";
import { reviewEn } from "../texts/en.review";

export const reviewTexts: ReviewTexts = others ?? reviewEn;
