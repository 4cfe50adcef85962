(** Linear temporal logic on finite words, and progression through letters. *)

Require Import List Bool Arith Lia.
Import ListNotations.

(** A letter is the list of the propositions that hold. *)
Definition letter : Type := list nat.
Definition word : Type := list letter.
Definition shows (a : letter) (p : nat) : bool := existsb (Nat.eqb p) a.

(** ** Formulas as missions write them, and their textbook meaning

    [sat w f]: the word, from its first letter on, satisfies f (LTLf, De Giacomo
    and Vardi 2013).  A suffix of a word is [skipn i w]. *)

Inductive spec :=
  | SAtom (p : nat) | STrue | SNot (f : spec) | SAnd (f g : spec) | SOr (f g : spec)
  | SUntil (f g : spec) | SRelease (f g : spec).

Definition SEventually f := SUntil STrue f.
Definition SAlways f := SRelease (SNot STrue) f.
Definition SWeakUntil f g := SRelease g (SOr f g).
Definition SStrongRelease f g := SUntil g (SAnd f g).

Definition until (P Q : word -> Prop) (w : word) : Prop :=
  exists i, i < length w /\ Q (skipn i w) /\ forall j, j < i -> P (skipn j w).
Definition release (P Q : word -> Prop) (w : word) : Prop :=
  forall i, i < length w -> Q (skipn i w) \/ exists j, j < i /\ P (skipn j w).
Definition first (p : letter -> bool) (w : word) : Prop :=
  match w with a :: _ => p a = true | [] => False end.

Fixpoint ssat (f : spec) (w : word) : Prop :=
  match f with
  | SAtom p => first (fun a => shows a p) w
  | STrue => True
  | SNot g => ~ ssat g w
  | SAnd g h => ssat g w /\ ssat h w
  | SOr g h => ssat g w \/ ssat h w
  | SUntil g h => until (ssat g) (ssat h) w
  | SRelease g h => release (ssat g) (ssat h) w
  end.

(** ** Formulas with negation at propositions only *)

Inductive formula :=
  | Lit (b : bool) (p : nat) | Const (b : bool) | And (f g : formula) | Or (f g : formula)
  | Until (f g : formula) | Release (f g : formula).

Fixpoint sat (f : formula) (w : word) : Prop :=
  match f with
  | Lit b p => first (fun a => Bool.eqb (shows a p) b) w
  | Const b => b = true
  | And g h => sat g w /\ sat h w
  | Or g h => sat g w \/ sat h w
  | Until g h => until (sat g) (sat h) w
  | Release g h => release (sat g) (sat h) w
  end.

Fixpoint normal (b : bool) (f : spec) : formula :=
  match f with
  | SAtom p => Lit b p
  | STrue => Const b
  | SNot g => normal (negb b) g
  | SAnd g h => (if b then And else Or) (normal b g) (normal b h)
  | SOr g h => (if b then Or else And) (normal b g) (normal b h)
  | SUntil g h => (if b then Until else Release) (normal b g) (normal b h)
  | SRelease g h => (if b then Release else Until) (normal b g) (normal b h)
  end.

(** *** Both operators, letter by letter *)

Lemma until_cons : forall P Q a w,
  until P Q (a :: w) <-> Q (a :: w) \/ (P (a :: w) /\ until P Q w).
Proof.
  split.
  - intros ([|i] & Hi & HQ & HP); [left; exact HQ | right; split].
    + apply (HP 0); lia.
    + exists i; simpl in Hi; repeat split; [lia | exact HQ|].
      intros j Hj; apply (HP (S j)); lia.
  - intros [HQ | (HP & i & Hi & HQ & H)].
    + exists 0; simpl; repeat split; [lia | exact HQ | lia].
    + exists (S i); simpl; repeat split; [lia | exact HQ|].
      intros [|j] Hj; [exact HP | apply H; lia].
Qed.

Definition decided (P : word -> Prop) : Prop := forall w, P w \/ ~ P w.

Lemma release_cons : forall P Q a w, decided P ->
  (release P Q (a :: w) <-> Q (a :: w) /\ (P (a :: w) \/ release P Q w)).
Proof.
  intros P Q a w D; split.
  - intros H; split.
    + destruct (H 0) as [HQ | (j & Hj & _)]; [simpl; lia | exact HQ | lia].
    + destruct (D (a :: w)) as [HP | NP]; [auto | right].
      intros i Hi; destruct (H (S i)) as [HQ | ([|j] & Hj & HP)];
        [simpl; lia | left; exact HQ | contradiction | right; exists j; split; [lia | exact HP]].
  - intros [HQ H] [|i] Hi; [left; exact HQ|].
    destruct H as [HP | H]; [right; exists 0; split; [lia | exact HP]|].
    destruct (H i) as [HQ' | (j & Hj & HP)]; [simpl in Hi; lia | left; exact HQ'|].
    right; exists (S j); split; [lia | exact HP].
Qed.

Lemma until_nil : forall P Q, ~ until P Q [].
Proof. intros P Q (i & Hi & _); simpl in Hi; lia. Qed.

Lemma release_nil : forall P Q, release P Q [].
Proof. intros P Q i Hi; simpl in Hi; lia. Qed.

Lemma until_decided : forall P Q, decided P -> decided Q -> decided (until P Q).
Proof.
  intros P Q DP DQ w; induction w as [|a w IH]; [right; apply until_nil|].
  rewrite until_cons; destruct (DP (a :: w)), (DQ (a :: w)), IH; tauto.
Qed.

Lemma release_decided : forall P Q, decided P -> decided Q -> decided (release P Q).
Proof.
  intros P Q DP DQ w; induction w as [|a w IH]; [left; apply release_nil|].
  rewrite release_cons by auto; destruct (DP (a :: w)), (DQ (a :: w)), IH; tauto.
Qed.

Lemma first_decided : forall p, decided (first p).
Proof. intros p [|a w]; simpl; [tauto | destruct (p a); auto]. Qed.

Ltac decide_at w :=
  repeat match goal with H : decided _ |- _ => specialize (H w) end; tauto.

Lemma ssat_decided : forall f, decided (ssat f).
Proof.
  induction f; cbn [ssat]; auto using first_decided, until_decided, release_decided;
    intros w; decide_at w.
Qed.

Lemma sat_decided : forall f, decided (sat f).
Proof.
  induction f; cbn [sat]; auto using first_decided, until_decided, release_decided;
    intros w; [destruct b; auto | decide_at w | decide_at w].
Qed.

(** *** Pushing negation inwards keeps the meaning *)

Lemma until_ext : forall P Q P' Q' w,
  (forall v, v <> [] -> (P v <-> P' v)) -> (forall v, v <> [] -> (Q v <-> Q' v)) ->
  (until P Q w <-> until P' Q' w).
Proof.
  intros P Q P' Q' w HP HQ; induction w as [|a w IH].
  - split; intros H; apply until_nil in H; tauto.
  - rewrite !until_cons, IH, HP, HQ by discriminate; tauto.
Qed.

Lemma release_ext : forall P Q P' Q' w, decided P -> decided P' ->
  (forall v, v <> [] -> (P v <-> P' v)) -> (forall v, v <> [] -> (Q v <-> Q' v)) ->
  (release P Q w <-> release P' Q' w).
Proof.
  intros P Q P' Q' w D D' HP HQ; induction w as [|a w IH].
  - split; intros _; apply release_nil.
  - rewrite !release_cons, IH, HP, HQ by (auto; discriminate); tauto.
Qed.

Lemma release_not_until : forall P Q P' Q' w, decided P -> decided Q -> decided P' ->
  (forall v, v <> [] -> (P' v <-> ~ P v)) -> (forall v, v <> [] -> (Q' v <-> ~ Q v)) ->
  (release P' Q' w <-> ~ until P Q w).
Proof.
  intros P Q P' Q' w D DQ D' HP HQ; induction w as [|a w IH].
  - split; intros; [apply until_nil | apply release_nil].
  - rewrite until_cons, release_cons, IH, HP, HQ by (auto; discriminate).
    destruct (D (a :: w)), (DQ (a :: w)); tauto.
Qed.

Lemma until_not_release : forall P Q P' Q' w, decided P -> decided Q ->
  (forall v, v <> [] -> (P' v <-> ~ P v)) -> (forall v, v <> [] -> (Q' v <-> ~ Q v)) ->
  (until P' Q' w <-> ~ release P Q w).
Proof.
  intros P Q P' Q' w D DQ HP HQ; induction w as [|a w IH].
  - split; intros H; [apply until_nil in H; tauto | destruct H; apply release_nil].
  - rewrite until_cons, release_cons, IH, HP, HQ by (auto; discriminate).
    destruct (D (a :: w)), (DQ (a :: w)); tauto.
Qed.

Lemma normal_meaning : forall f b w, w <> [] ->
  (sat (normal b f) w <-> if b then ssat f w else ~ ssat f w).
Proof.
  induction f; intros b w Hw.
  - destruct w as [|a w]; [congruence|]; simpl; destruct b, (shows a p); simpl; intuition congruence.
  - destruct b; simpl; intuition congruence.
  - simpl; rewrite IHf by auto; destruct b; simpl; [tauto|].
    destruct (ssat_decided f w); tauto.
  - specialize (IHf1 b w Hw); specialize (IHf2 b w Hw).
    destruct b; simpl; rewrite IHf1, IHf2; [tauto|].
    destruct (ssat_decided f1 w), (ssat_decided f2 w); tauto.
  - specialize (IHf1 b w Hw); specialize (IHf2 b w Hw).
    destruct b; simpl; rewrite IHf1, IHf2; [tauto|].
    destruct (ssat_decided f1 w), (ssat_decided f2 w); tauto.
  - destruct b; simpl.
    + apply until_ext; auto using ssat_decided, sat_decided; intros v Hv;
        [apply (IHf1 true) | apply (IHf2 true)]; auto.
    + apply release_not_until; auto using ssat_decided, sat_decided; intros v Hv;
        [apply (IHf1 false) | apply (IHf2 false)]; auto.
  - destruct b; simpl.
    + apply release_ext; auto using ssat_decided, sat_decided; intros v Hv;
        [apply (IHf1 true) | apply (IHf2 true)]; auto.
    + apply until_not_release; auto using ssat_decided; intros v Hv;
        [apply (IHf1 false) | apply (IHf2 false)]; auto.
Qed.

(** A mission's formula and its normal form agree on every word of a letter or more. *)
Theorem normal_sat : forall f w, w <> [] -> (sat (normal true f) w <-> ssat f w).
Proof. intros f w H; apply (normal_meaning f true w H). Qed.

(** ** Progression

    A state says what the rest of the word owes: one of its alternatives, and of
    that one every obligation.  The rest of a word may be empty. *)

Definition alternative : Type := list formula.
Definition state : Type := list alternative.

Definition owes (s : state) (w : word) : Prop :=
  exists c, In c s /\ forall f, In f c -> sat f w.

Fixpoint same (f g : formula) : bool :=
  match f, g with
  | Lit b p, Lit c q => Bool.eqb b c && (p =? q)
  | Const b, Const c => Bool.eqb b c
  | And f1 f2, And g1 g2 | Or f1 f2, Or g1 g2
  | Until f1 f2, Until g1 g2 | Release f1 f2, Release g1 g2 => same f1 g1 && same f2 g2
  | _, _ => false
  end.

Lemma same_eq : forall f g, same f g = true -> f = g.
Proof.
  induction f; intros [] H; try discriminate; cbn in H;
    try (apply andb_prop in H as [H1 H2]); f_equal; auto using eqb_prop.
  apply Nat.eqb_eq; auto.
Qed.

(** Every obligation of [d] is one of [c]. *)
Definition includes (c d : alternative) : bool :=
  forallb (fun f => existsb (same f) c) d.
(** Both of two alternatives' obligations, each once. *)
Definition merge (c d : alternative) : alternative :=
  c ++ filter (fun f => negb (existsb (same f) c)) d.

(** Alternatives that include another one add nothing. *)
Fixpoint tidy (s : state) : state :=
  match s with
  | [] => []
  | c :: r =>
      let t := tidy r in
      if existsb (includes c) t then t else c :: filter (fun d => negb (includes d c)) t
  end.

Definition either (s t : state) : state := tidy (s ++ t).
Definition conjoin (s t : state) : state :=
  tidy (flat_map (fun c => map (merge c) t) s).

Definition holds_now (b : bool) : state := if b then [[]] else [].

(** What is owed after letter [a]. *)
Fixpoint progress (a : letter) (f : formula) : state :=
  match f with
  | Lit b p => holds_now (Bool.eqb (shows a p) b)
  | Const b => holds_now b
  | And g h => conjoin (progress a g) (progress a h)
  | Or g h => either (progress a g) (progress a h)
  | Until g h => either (progress a h) (conjoin (progress a g) [[f]])
  | Release g h => conjoin (progress a h) (either (progress a g) [[f]])
  end.

Definition progress_all (a : letter) (c : alternative) : state :=
  fold_right (fun f s => conjoin (progress a f) s) [[]] c.
Definition progress_state (a : letter) (s : state) : state := tidy (flat_map (progress_all a) s).

(** The empty word keeps what asks for nothing more. *)
Definition idle (f : formula) : bool :=
  match f with Release _ _ => true | Const b => b | _ => false end.
Definition accepts (s : state) : bool := existsb (forallb idle) s.

Lemma includes_sound : forall c d w, includes c d = true ->
  (forall f, In f c -> sat f w) -> forall f, In f d -> sat f w.
Proof.
  intros c d w I H f Hf; unfold includes in I; rewrite forallb_forall in I.
  apply I, existsb_exists in Hf as (g & Hg & E); apply same_eq in E; subst; auto.
Qed.

Lemma tidy_in : forall s c, In c (tidy s) -> In c s.
Proof.
  induction s as [|c s IH]; intros d H; cbn in H; auto.
  destruct (existsb (includes c) (tidy s)); [right; auto|].
  destruct H as [<-|H]; [left; auto | right; apply filter_In in H; apply IH; tauto].
Qed.

Lemma owes_tidy : forall s w, owes (tidy s) w <-> owes s w.
Proof.
  intros s w; split; [intros (c & Hc & H); exists c; auto using tidy_in|].
  intros (c & Hc & H); revert c Hc H; induction s as [|d s IH]; intros c Hc H; [destruct Hc|].
  cbn; destruct (existsb (includes d) (tidy s)) eqn:E.
  - destruct Hc as [->|Hc]; [|eauto].
    apply existsb_exists in E as (e & He & I); exists e; eauto using includes_sound.
  - destruct Hc as [->|Hc]; [exists c; split; [left|]; auto|].
    destruct (IH c Hc H) as (e & He & K).
    destruct (includes e d) eqn:I.
    + exists d; split; [left; auto | apply (includes_sound e); auto].
    + exists e; split; auto; right; apply filter_In; rewrite I; auto.
Qed.

Lemma owes_either : forall s t w, owes (either s t) w <-> owes s w \/ owes t w.
Proof.
  intros s t w; unfold either; rewrite owes_tidy; unfold owes; split.
  - intros (c & Hc & H); apply in_app_or in Hc as [Hc|Hc]; eauto.
  - intros [(c & Hc & H) | (c & Hc & H)]; exists c; split; auto; apply in_or_app; auto.
Qed.

Lemma merge_sat : forall c d w,
  (forall f, In f (merge c d) -> sat f w) <->
  (forall f, In f c -> sat f w) /\ (forall f, In f d -> sat f w).
Proof.
  intros c d w; unfold merge; split.
  - intros H; split; intros f Hf; [apply H, in_or_app; auto|].
    destruct (existsb (same f) c) eqn:E.
    + apply existsb_exists in E as (g & Hg & E); apply same_eq in E; subst g.
      apply H, in_or_app; auto.
    + apply H, in_or_app; right; apply filter_In; rewrite E; auto.
  - intros [Hc Hd] f Hf; apply in_app_or in Hf as [Hf|Hf]; auto.
    apply filter_In in Hf; apply Hd; tauto.
Qed.

Lemma owes_conjoin : forall s t w, owes (conjoin s t) w <-> owes s w /\ owes t w.
Proof.
  intros s t w; unfold conjoin; rewrite owes_tidy; unfold owes; split.
  - intros (c & Hc & H); apply in_flat_map in Hc as (d & Hd & Hc).
    apply in_map_iff in Hc as (e & <- & He); apply merge_sat in H as [Kd Ke]; split; eauto.
  - intros [(d & Hd & H) (e & He & K)]; exists (merge d e); split; [|apply merge_sat; auto].
    apply in_flat_map; exists d; split; auto. apply in_map; auto.
Qed.

Lemma owes_one : forall f w, owes [[f]] w <-> sat f w.
Proof.
  unfold owes; intros f w; split.
  - intros (c & [<-|[]] & H); apply H; left; auto.
  - intros H; exists [f]; split; [left; auto | intros g [<-|[]]; auto].
Qed.

Lemma owes_now : forall b w, owes (holds_now b) w <-> b = true.
Proof.
  unfold owes; intros [|] w; simpl; split; auto; try discriminate.
  - intros _; exists []; split; auto; intros f [].
  - intros (c & [] & _).
Qed.

Theorem progress_sat : forall f a w, owes (progress a f) w <-> sat f (a :: w).
Proof.
  induction f; intros a w; cbn [progress];
    rewrite ?owes_now, ?owes_either, ?owes_conjoin, ?owes_either, ?owes_one, ?IHf1, ?IHf2;
    cbn [sat first]; rewrite ?until_cons, ?release_cons by apply sat_decided; tauto.
Qed.

Lemma progress_all_sat : forall c a w,
  owes (progress_all a c) w <-> forall f, In f c -> sat f (a :: w).
Proof.
  induction c as [|g c IH]; intros a w; simpl.
  - split; [intros _ f [] | intros _; apply (owes_now true); auto].
  - rewrite owes_conjoin, progress_sat, IH; split.
    + intros [Hg Hc] f [<-|Hf]; auto.
    + intros H; split; auto.
Qed.

Theorem progress_state_sat : forall s a w,
  owes (progress_state a s) w <-> owes s (a :: w).
Proof.
  intros s a w; unfold progress_state; rewrite owes_tidy; unfold owes at 1; split.
  - intros (d & Hd & H); apply in_flat_map in Hd as (c & Hc & Hd).
    exists c; split; auto; apply progress_all_sat; exists d; auto.
  - intros (c & Hc & H); apply progress_all_sat in H as (d & Hd & H).
    exists d; split; auto; apply in_flat_map; eauto.
Qed.

Theorem accepts_sound : forall s, accepts s = true -> owes s [].
Proof.
  intros s H; apply existsb_exists in H as (c & Hc & H); exists c; split; auto.
  intros f Hf; rewrite forallb_forall in H; apply H in Hf.
  destruct f; simpl in *; try discriminate; auto using release_nil.
Qed.

(** *** Deciding a word *)

(** What progression leaves is always an until or a release. *)
Definition temporal (f : formula) : bool :=
  match f with Until _ _ | Release _ _ => true | _ => false end.
Definition all_temporal (s : state) : Prop := forall c f, In c s -> In f c -> temporal f = true.

Lemma temporal_either : forall s t, all_temporal s -> all_temporal t -> all_temporal (either s t).
Proof. intros s t Hs Ht c f Hc; apply tidy_in, in_app_or in Hc as [Hc|Hc]; eauto. Qed.

Lemma temporal_conjoin : forall s t, all_temporal s -> all_temporal t -> all_temporal (conjoin s t).
Proof.
  intros s t Hs Ht c f Hc Hf; apply tidy_in, in_flat_map in Hc as (d & Hd & Hc).
  apply in_map_iff in Hc as (e & <- & He); apply in_app_or in Hf as [Hf|Hf]; eauto.
  apply filter_In in Hf as [Hf _]; eauto.
Qed.

Lemma temporal_one : forall f, temporal f = true -> all_temporal [[f]].
Proof. intros f H c g [<-|[]] [<-|[]]; auto. Qed.

Lemma temporal_now : forall b, all_temporal (holds_now b).
Proof. intros [|] c f; simpl; [intros [<-|[]] [] | intros []]. Qed.

Lemma progress_temporal : forall a f, all_temporal (progress a f).
Proof.
  induction f; cbn [progress];
    auto using temporal_either, temporal_conjoin, temporal_one, temporal_now.
Qed.

Lemma progress_state_temporal : forall a s, all_temporal (progress_state a s).
Proof.
  intros a s c f Hc; apply tidy_in, in_flat_map in Hc as (d & _ & Hc); revert c Hc.
  cut (all_temporal (progress_all a d)); [intros H c Hc; apply (H c f Hc)|].
  induction d as [|g d IH]; [apply (temporal_now true) | apply temporal_conjoin; auto].
  apply progress_temporal.
Qed.

Lemma accepts_complete : forall s, all_temporal s -> owes s [] -> accepts s = true.
Proof.
  intros s T (c & Hc & H); apply existsb_exists; exists c; split; auto.
  apply forallb_forall; intros f Hf; specialize (T c f Hc Hf); specialize (H f Hf).
  destruct f; try discriminate; auto. cbn in H; apply until_nil in H; tauto.
Qed.

Definition satisfies (f : spec) (w : word) : bool :=
  accepts (fold_left (fun s a => progress_state a s) w [[normal true f]]).

Theorem satisfies_correct : forall f w, w <> [] -> (satisfies f w = true <-> ssat f w).
Proof.
  intros f w H; rewrite <- normal_sat, <- owes_one by auto; unfold satisfies.
  assert (G : forall v s, all_temporal s ->
    accepts (fold_left (fun s a => progress_state a s) v s) = true <-> owes s v).
  { induction v as [|a v IH]; intros s T; cbn.
    - split; [apply accepts_sound | apply accepts_complete; auto].
    - rewrite IH by apply progress_state_temporal; apply progress_state_sat. }
  destruct w as [|a w]; [congruence|]; cbn [fold_left].
  rewrite G by apply progress_state_temporal; apply progress_state_sat.
Qed.

(** ** Letters that are held, and letters that are cut *)

(** Words that no formula tells apart stay so behind a letter. *)
Definition alike (v w : word) : Prop := forall f, sat f v <-> sat f w.

Lemma alike_owes : forall v w, alike v w -> forall s, owes s v <-> owes s w.
Proof.
  intros v w H s; unfold owes; split; intros (c & Hc & K); exists c; split; auto;
    intros f Hf; apply H; auto.
Qed.

Lemma alike_cons : forall a v w, alike v w -> alike (a :: v) (a :: w).
Proof. intros a v w H f; rewrite <- !progress_sat; apply alike_owes; auto. Qed.

(** A letter that is read again changes nothing, as no formula has next. *)
Theorem stutter : forall a w, alike (a :: a :: w) (a :: w).
Proof.
  intros a w f; induction f; cbn [sat first]; rewrite ?until_cons, ?release_cons, ?IHf1, ?IHf2;
    try tauto; auto using sat_decided.
Qed.

Fixpoint names (f : spec) : list nat :=
  match f with
  | SAtom p => [p]
  | STrue => []
  | SNot g => names g
  | SAnd g h | SOr g h | SUntil g h | SRelease g h => names g ++ names h
  end.

(** Letters may be cut to the formula's own propositions. *)
Theorem cut_letters : forall (cut : letter -> letter) f w,
  (forall p a, In p (names f) -> shows (cut a) p = shows a p) ->
  (ssat f (map cut w) <-> ssat f w).
Proof.
  intros cut f; induction f; intros w H; cbn [ssat names] in *;
    try (assert (H1 : forall w, ssat f1 (map cut w) <-> ssat f1 w)
           by (intros; apply IHf1; intros; apply H, in_or_app; auto);
         assert (H2 : forall w, ssat f2 (map cut w) <-> ssat f2 w)
           by (intros; apply IHf2; intros; apply H, in_or_app; auto)).
  - destruct w as [|a w]; cbn; [tauto|]; rewrite H by (left; auto); tauto.
  - tauto.
  - rewrite IHf by auto; tauto.
  - rewrite H1, H2; tauto.
  - rewrite H1, H2; tauto.
  - induction w as [|a w IH]; [tauto|]; cbn [map]; rewrite !until_cons, IH.
    change (cut a :: map cut w) with (map cut (a :: w)); rewrite H1, H2; tauto.
  - induction w as [|a w IH]; [cbn; tauto|]; cbn [map].
    rewrite !release_cons, IH by apply ssat_decided.
    change (cut a :: map cut w) with (map cut (a :: w)); rewrite H1, H2; tauto.
Qed.
