/** What the editor says, in the language that was chosen before the editor was loaded. */

import { type EditorTexts, editorTexts as others } from "../texts";
import { editorEn } from "../texts/en.editor";

export const editorTexts: EditorTexts = others ?? editorEn;
